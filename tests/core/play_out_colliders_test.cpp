// SPDX-License-Identifier: MIT
// Colliders of play-out: they belong to the same time as the cloth that is shown.
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clients/core/core.h"
#include "tests/core/play_out_viewer.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

// Position of ScriptedServer's finger at a tick, which may be fractional.
void expectFingerAt(const cs_collider& finger, double tick) {
  // Tolerance: float rounding up to 1, and the distance between an arc of 0.05 and its chord extrapolated by
  // half: 0.05^3 / 3.
  EXPECT_NEAR(finger.position[1], 0.02 * tick, 1e-6);
  EXPECT_NEAR(finger.orientation[2], std::sin(0.05 * tick), 5e-5);
  EXPECT_NEAR(finger.orientation[3], std::cos(0.05 * tick), 5e-5);
  EXPECT_EQ(finger.radius, 0.01f);
}

TEST(PlayOut, CollidersMatchTheTimeOfTheCloth) {
  Viewer viewer(chosenDelay(50));
  viewer.learnClock();
  for (std::uint64_t tick = 1; tick <= 5; ++tick)
    viewer.receive(tick, tick * kFrameUs, tick * kFrameUs + 20 * kMs);
  expectFingerAt(viewer.playedCollider(7), 5);  // newest frame before play-out starts
  EXPECT_EQ(viewer.play(3 * kFrameUs + 50 * kMs).shown, CS_SHOWN_FRAME);
  expectFingerAt(viewer.playedCollider(7), 3);
  EXPECT_EQ(viewer.playedCollider(0).position[0], 3);
  EXPECT_EQ(viewer.play(3 * kFrameUs + 52'500).fraction, 0.25);
  expectFingerAt(viewer.playedCollider(7), 3.25);
  EXPECT_EQ(viewer.play(3 * kFrameUs + 57'500).fraction, 0.75);
  expectFingerAt(viewer.playedCollider(7), 3.75);
  EXPECT_EQ(viewer.playedCollider(0).position[0], 3) << "a jump happens at the next frame";
  EXPECT_EQ(viewer.play(5 * kFrameUs + 55 * kMs).shown, CS_SHOWN_LED_ON);
  expectFingerAt(viewer.playedCollider(7), 5.5);
  EXPECT_EQ(viewer.playedCollider(0).position[0], 5) << "jumps are not extrapolated";
  EXPECT_EQ(viewer.play(5 * kFrameUs + 200 * kMs).shown, CS_SHOWN_HELD);
  expectFingerAt(viewer.playedCollider(7), 5);
  EXPECT_EQ(cs_played_collider_count(viewer.client.get()), cs_collider_count(viewer.client.get()));

  viewer.play(3 * kFrameUs + 52'500);
  expectFingerAt(viewer.newestCollider(7), 5);
  ASSERT_EQ(cs_set_play_out(viewer.client.get(), nullptr), 1);
  expectFingerAt(viewer.playedCollider(7), 5);
}

TEST(PlayOut, CollidersAppearAndDisappearWithTheirFrames) {
  Viewer viewer(chosenDelay(50));
  viewer.learnClock();
  const auto receive = [&](std::uint64_t tick, const std::vector<std::uint64_t>& participants) {
    v1::Frame frame = viewer.server.frameMessage(tick, codec::PacketKind::predicted);
    const v1::ColliderState finger = frame.colliders(2);
    frame.clear_colliders();
    for (const std::uint64_t participant : participants) {
      *frame.add_colliders() = finger;
      frame.mutable_colliders()->rbegin()->set_participant_id(participant);
    }
    frame.set_tick_time_us(tick * kFrameUs + kServerAhead);
    viewer.client.receive(ScriptedServer::serialise(frame), tick * kFrameUs);
  };
  const auto countAt = [&](double tick) {
    viewer.play(static_cast<std::uint64_t>(tick * kFrameUs) + 50 * kMs);
    return cs_played_collider_count(viewer.client.get());
  };
  receive(1, {1, 3, 7});
  receive(2, {2, 3, 7});
  receive(3, {7});
  EXPECT_EQ(countAt(1.5), 3u);
  expectFingerAt(viewer.playedCollider(1), 1);
  expectFingerAt(viewer.playedCollider(3), 1.5);
  expectFingerAt(viewer.playedCollider(7), 1.5);
  EXPECT_EQ(countAt(2.5), 3u);
  expectFingerAt(viewer.playedCollider(2), 2);
  expectFingerAt(viewer.playedCollider(7), 2.5);
  EXPECT_EQ(countAt(3.5), 1u);
  expectFingerAt(viewer.playedCollider(7), 3.5);
}

TEST(PlayOut, CollidersTurnTheShorterWay) {
  Viewer viewer(chosenDelay(50));
  viewer.learnClock();
  for (std::uint64_t tick = 1; tick <= 2; ++tick) {
    v1::Frame frame = viewer.server.frameMessage(tick, codec::PacketKind::predicted);
    v1::Quaternion& q = *frame.mutable_colliders(2)->mutable_orientation();
    // The first has the same rotation with the opposite sign. The other turns by 180 degrees, where neither
    // way is shorter.
    if (tick == 2) {
      q.set_z(-q.z());
      q.set_w(-q.w());
      frame.mutable_colliders(0)->mutable_orientation()->set_y(1);
      frame.mutable_colliders(0)->mutable_position()->set_x(1);
    }
    frame.set_tick_time_us(tick * kFrameUs + kServerAhead);
    viewer.client.receive(ScriptedServer::serialise(frame), tick * kFrameUs);
  }
  viewer.play(kFrameUs + 55 * kMs);
  expectFingerAt(viewer.playedCollider(7), 1.5);
  EXPECT_EQ(viewer.playedCollider(0).orientation[3], 1);
}

TEST(PlayOut, CollidersAllocateNothingInAFullRing) {
  Viewer viewer(chosenDelay(50));
  viewer.learnClock();
  const std::string longName(100, 'x');
  std::set<const char*> names;
  for (std::uint64_t tick = 1; tick <= 200; ++tick) {
    v1::Frame frame = viewer.server.frameMessage(tick, codec::PacketKind::predicted);
    for (v1::ColliderState& collider : *frame.mutable_colliders()) collider.set_name(longName);
    frame.set_tick_time_us(tick * kFrameUs + kServerAhead);
    viewer.client.receive(ScriptedServer::serialise(frame), tick * kFrameUs);
    viewer.play(tick * kFrameUs + (tick % 2 == 0 ? 0 : 5 * kMs));
    if (tick > 10) names.insert(viewer.playedCollider(7).name);
  }
  // Names of each kept frame, and of the interpolated colliders.
  EXPECT_LE(names.size(), std::size_t{defaultPlayOut().frames} + 1);
}

}  // namespace
}  // namespace clothstream::client
