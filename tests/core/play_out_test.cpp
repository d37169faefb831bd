// SPDX-License-Identifier: MIT
// Cloth that play-out shows: gaps, jumps in time and new descriptions.
#include "clients/core/stream/play_out.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/vertex_normals.h"
#include "tests/core/play_out_viewer.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

Floats between(const Floats& base, const Floats& from, const Floats& to, float fraction) {
  Floats result(base.size());
  for (std::size_t i = 0; i < base.size(); ++i) result[i] = base[i] + (to[i] - from[i]) * fraction;
  return result;
}

TEST(PlayOut, IsOffByDefault) {
  ClientUnderTest client;
  ScriptedServer server;
  client.join(server);
  client.receive(server.frame(1));
  EXPECT_EQ(cs_play_out(client.get(), 1, 1, nullptr), 0);
  EXPECT_EQ(cs_played_positions(client.get()), cs_positions(client.get()));
  const cs_play_out_options options = defaultPlayOut();
  ASSERT_EQ(cs_set_play_out(client.get(), &options), 1);
  EXPECT_EQ(cs_play_out(client.get(), 1, 1, nullptr), 1);
  ASSERT_EQ(cs_set_play_out(client.get(), nullptr), 1);
  EXPECT_EQ(cs_play_out(client.get(), 1, 1, nullptr), 0);
}

TEST(PlayOut, RefusesInvalidOptions) {
  Viewer viewer;
  const auto refused = [&](auto change) {
    cs_play_out_options options = defaultPlayOut();
    change(options);
    return cs_set_play_out(viewer.client.get(), &options) == 0;
  };
  EXPECT_TRUE(refused([](auto& o) { o.version = 2; }));
  EXPECT_TRUE(refused([](auto& o) { o.frames = 2; }));
  EXPECT_TRUE(refused([](auto& o) { o.frames = 257; }));
  EXPECT_TRUE(refused([](auto& o) { o.delay_ms = -1; }));
  EXPECT_TRUE(refused([](auto& o) { o.delay_ms = 10'001; }));
  EXPECT_TRUE(refused([](auto& o) { o.least_delay_ms = o.most_delay_ms + 1; }));
  EXPECT_TRUE(refused([](auto& o) { o.most_delay_ms = NAN; }));
  EXPECT_TRUE(refused([](auto& o) { o.lead_ms = NAN; }));
  EXPECT_TRUE(refused([](auto& o) { o.lead_ms = 1001; }));
  EXPECT_FALSE(refused([](auto& o) { o.lead_ms = 0; }));
  cs_played played{};
  played.version = CS_PLAYED_VERSION + 1;
  EXPECT_EQ(cs_play_out(viewer.client.get(), 1, 1, &played), 0) << "unknown version";
  cs_stage_statistics stages{};
  stages.version = CS_STAGE_STATISTICS_VERSION + 1;
  EXPECT_EQ(cs_get_stage_statistics(viewer.client.get(), &stages), 0);
}

class PlayOutOf : public ::testing::TestWithParam<codec::NormalMode> {};

TEST_P(PlayOutOf, ShowsAFrameBitForBitAtItsTime) {
  Viewer viewer(chosenDelay(50), {.normals = GetParam(), .cloths = {{"a", 9, 7}, {"b", 4, 5}}});
  viewer.learnClock();
  std::vector<Floats> positions, normals;
  for (std::uint64_t tick = 1; tick <= 10; ++tick) {
    viewer.receive(tick, tick * kFrameUs, tick * kFrameUs + 20 * kMs);
    positions.push_back(viewer.positions());
    normals.push_back(viewer.normals());
  }
  for (std::uint64_t tick = 1; tick <= 10; ++tick) {
    const cs_played played = viewer.play(tick * kFrameUs + 50 * kMs);
    EXPECT_EQ(played.shown, CS_SHOWN_FRAME);
    EXPECT_EQ(played.tick, tick);
    EXPECT_EQ(played.fraction, 0);
    EXPECT_EQ(played.server_time_us, tick * kFrameUs + kServerAhead);
    EXPECT_TRUE(sameBits(viewer.playedPositions(), positions[tick - 1]));
    EXPECT_TRUE(sameBits(viewer.playedNormals(), normals[tick - 1]));
  }
}

TEST_P(PlayOutOf, InterpolatesBetweenTwoFrames) {
  Viewer viewer(chosenDelay(50), {.normals = GetParam()});
  viewer.learnClock();
  viewer.receive(1, 100 * kMs, 110 * kMs);
  const Floats before = viewer.positions(), normalsBefore = viewer.normals();
  viewer.receive(2, 110 * kMs, 120 * kMs);
  const Floats after = viewer.positions(), normalsAfter = viewer.normals();
  ASSERT_FALSE(sameBits(normalsBefore, normalsAfter));
  const cs_played played = viewer.play(152'500);
  EXPECT_EQ(played.shown, CS_SHOWN_BETWEEN);
  EXPECT_EQ(played.tick, 1u);
  EXPECT_EQ(played.fraction, 0.25);
  const Floats shown = viewer.playedPositions();
  EXPECT_TRUE(sameBits(shown, between(before, before, after, 0.25f)));
  const Floats normals = viewer.playedNormals();
  if (GetParam() == codec::NormalMode::none) {
    codec::StreamLayout layout;
    layout.cloths.push_back({63, 9, 7});
    Floats computed(shown.size());
    codec::computeVertexNormals(layout, shown.data(), computed.data());
    EXPECT_TRUE(sameBits(normals, computed));
    return;
  }
  const Floats line = between(normalsBefore, normalsBefore, normalsAfter, 0.25f);
  for (std::size_t i = 0; i < line.size(); i += 3) {
    const float length = std::hypot(line[i], line[i + 1], line[i + 2]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(normals[i + axis], line[i + axis] / length, 4 * 6e-8) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Normals, PlayOutOf,
                         ::testing::Values(codec::NormalMode::none, codec::NormalMode::octahedral),
                         [](const auto& mode) {
                           return mode.param == codec::NormalMode::none ? "Computed" : "Sent";
                         });

TEST(PlayOut, ShowsTheNewestFrameWhileTheServersClockIsUnknown) {
  Viewer viewer(chosenDelay(50));
  EXPECT_EQ(viewer.play(5 * kMs).shown, CS_SHOWN_NOTHING);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions())) << "at rest";
  for (std::uint64_t tick = 1; tick <= 3; ++tick) {
    viewer.receive(tick, tick * kFrameUs, tick * kFrameUs);
    const cs_played played = viewer.play(tick * kFrameUs);
    EXPECT_EQ(played.shown, CS_SHOWN_HELD);
    EXPECT_EQ(played.tick, tick);
    EXPECT_EQ(played.server_time_us, 0u);
    EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions()));
    EXPECT_EQ(viewer.stages().displayable_ms, 0);
  }
}

TEST(PlayOut, ExtrapolatesOverAGapAndReturns) {
  cs_play_out_options options = chosenDelay(50);
  options.lead_ms = 20;
  Viewer viewer(options);
  viewer.learnClock();
  viewer.receive(1, 10 * kMs, 30 * kMs);
  viewer.receive(2, 20 * kMs, 40 * kMs);
  const Floats before = viewer.positions();
  viewer.receive(3, 30 * kMs, 50 * kMs);
  const Floats newest = viewer.positions();
  ASSERT_EQ(viewer.play(80 * kMs).shown, CS_SHOWN_FRAME);
  const auto expectLed = [&](std::uint64_t pastUs, float steps) {
    const cs_played played = viewer.play(80 * kMs + pastUs);
    EXPECT_EQ(played.shown, CS_SHOWN_LED_ON);
    EXPECT_EQ(played.tick, 3u);
    EXPECT_FLOAT_EQ(static_cast<float>(played.fraction), steps);
    EXPECT_TRUE(sameBits(viewer.playedPositions(), between(newest, before, newest, steps))) << pastUs;
  };
  expectLed(5 * kMs, 0.5f);
  expectLed(20 * kMs, 2);
  expectLed(30 * kMs, 1);
  for (const std::uint64_t past : {40, 50, 10'000}) {
    EXPECT_EQ(viewer.play((80 + past) * kMs).shown, CS_SHOWN_HELD);
    EXPECT_TRUE(sameBits(viewer.playedPositions(), newest));
  }
  EXPECT_DOUBLE_EQ(viewer.stages().led_on_ms, 30);
  EXPECT_DOUBLE_EQ(viewer.stages().held_ms, 10'000 - 30);
  // The stream continues after the pause.
  viewer.receive(4, 10'080 * kMs, 10'090 * kMs);
  EXPECT_EQ(viewer.play(10'090 * kMs).shown, CS_SHOWN_BETWEEN);
  viewer.receive(5, 10'090 * kMs, 10'110 * kMs);
  EXPECT_EQ(viewer.play(10'135 * kMs).fraction, 0.5);
}

TEST(PlayOut, DoesNotExtrapolateAKeyFrameNorBeyondOneStep) {
  Viewer viewer(chosenDelay(0));
  viewer.learnClock();
  viewer.receive(1, 10 * kMs, 10 * kMs);
  viewer.receive(2, 20 * kMs, 20 * kMs, codec::PacketKind::key);
  EXPECT_EQ(viewer.play(25 * kMs).shown, CS_SHOWN_HELD);
  // A server that catches up: frames 10 us apart.
  viewer.receive(3, 20 * kMs + 10, 21 * kMs);
  const cs_played played = viewer.play(25 * kMs + 10);
  EXPECT_EQ(played.shown, CS_SHOWN_LED_ON);
  EXPECT_DOUBLE_EQ(played.fraction, 0.5);
}

TEST(PlayOut, InterpolatesAcrossMissingFrames) {
  Viewer viewer(chosenDelay(100));
  viewer.learnClock();
  viewer.receive(1, 10 * kMs, 20 * kMs, codec::PacketKind::key);
  const Floats before = viewer.positions();
  viewer.receive(5, 50 * kMs, 60 * kMs, codec::PacketKind::key);
  const Floats after = viewer.positions();
  EXPECT_EQ(viewer.play(130 * kMs).fraction, 0.5);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), between(before, before, after, 0.5f)));
}

TEST(PlayOut, ShowsTheOldestFrameIfTheDelayIsTooLong) {
  cs_play_out_options options = chosenDelay(1000);
  options.frames = 4;
  Viewer viewer(options);
  viewer.learnClock();
  std::set<const float*> places;
  for (std::uint64_t tick = 1; tick <= 100; ++tick) {
    viewer.receive(tick, tick * kFrameUs, tick * kFrameUs);
    const cs_played played = viewer.play(tick * kFrameUs);
    EXPECT_EQ(played.shown, CS_SHOWN_HELD);
    EXPECT_EQ(played.tick, tick < 4 ? 1 : tick - 3);
    places.insert(cs_played_positions(viewer.client.get()));
    EXPECT_EQ(viewer.stages().frames_waiting, std::min<std::uint64_t>(tick, 4));
  }
  EXPECT_EQ(places.size(), 4u) << "memory is allocated once";
}

TEST(PlayOut, KeepsFewerLargeFrames) {
  Description description;
  description.streamRate = 100;
  constexpr std::uint32_t kSide = 1500;
  description.layout.cloths.push_back({kSide * kSide, kSide, kSide});
  const Floats positions(3 * kSide * kSide);
  const std::uint64_t fit = PlayOut::kMaxBytes / (positions.size() * sizeof(float));
  ASSERT_LT(fit, defaultPlayOut().frames);
  PlayOut playOut(chosenDelay(0));
  playOut.begin(description);
  for (std::uint64_t tick = 1; tick <= fit + 5; ++tick)
    playOut.add(
        {.tick = tick, .timeUs = tick * kFrameUs, .key = false, .positions = positions, .normals = {}}, 1);
  EXPECT_EQ(playOut.play(1, 1).tick, 6u) << "the oldest kept frame";
}

TEST(PlayOut, CountsLateFrames) {
  Viewer viewer(chosenDelay(20));
  viewer.learnClock();
  viewer.receive(1, 10 * kMs, 20 * kMs);
  viewer.receive(2, 20 * kMs, 30 * kMs);
  viewer.play(45 * kMs);
  viewer.receive(3, 30 * kMs, 46 * kMs);
  EXPECT_EQ(viewer.stages().late_frames, 0u);
  viewer.play(65 * kMs);
  viewer.receive(4, 40 * kMs, 66 * kMs);
  EXPECT_EQ(viewer.stages().late_frames, 1u);
}

TEST(PlayOut, RestartsWhenTheServersTimeGoesBack) {
  Viewer viewer(chosenDelay(20));
  viewer.learnClock();
  viewer.receive(1, 5000 * kMs, 5010 * kMs);
  viewer.receive(2, 5010 * kMs, 5020 * kMs);
  ASSERT_EQ(viewer.play(5025 * kMs).shown, CS_SHOWN_BETWEEN);
  viewer.receive(3, 3000 * kMs, 5030 * kMs);
  EXPECT_EQ(viewer.play(5035 * kMs).shown, CS_SHOWN_HELD);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions()));
  EXPECT_EQ(viewer.play(5036 * kMs, 2990 * kMs).tick, 3u) << "frames of the earlier time are gone";
  viewer.receive(4, 3010 * kMs, 5040 * kMs);
  const cs_played played = viewer.play(5045 * kMs);
  EXPECT_EQ(played.tick, 4u);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions()));
}

TEST(PlayOut, RestartsAfterNewDescription) {
  Viewer viewer(chosenDelay(20));
  viewer.learnClock();
  viewer.receive(1, 10 * kMs, 20 * kMs);
  viewer.play(30 * kMs);
  ScriptedServer other({.epoch = 8, .cloths = {{"sheet", 21, 30}}});
  viewer.client.receiveAll(other.chunks(256 * 1024, 2), 40 * kMs);
  ASSERT_EQ(cs_vertex_count(viewer.client.get()), 630u);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions())) << "at rest";
  EXPECT_EQ(viewer.play(41 * kMs).shown, CS_SHOWN_NOTHING);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions()));
  viewer.server = std::move(other);
  viewer.receive(1, 45 * kMs, 50 * kMs);
  EXPECT_EQ(viewer.play(65 * kMs).shown, CS_SHOWN_FRAME);
  EXPECT_TRUE(sameBits(viewer.playedPositions(), viewer.positions()));
}

TEST(PlayOut, ReportsTimeOfEachStage) {
  Viewer viewer(chosenDelay(40));
  viewer.learnClock();
  static std::uint64_t clockUs;
  clockUs = 0;
  cs_set_clock(viewer.client.get(), [] { return clockUs += 2 * kMs; });
  viewer.receive(1, 100 * kMs, 125 * kMs);
  const cs_stage_statistics stages = viewer.stages();
  EXPECT_DOUBLE_EQ(stages.server_ms, 4);
  EXPECT_DOUBLE_EQ(stages.network_ms, 21);
  EXPECT_DOUBLE_EQ(stages.decode_ms, 2);
  EXPECT_DOUBLE_EQ(stages.displayable_ms, 27);
  viewer.play(130 * kMs);
  EXPECT_DOUBLE_EQ(viewer.stages().delay_ms, 40);
}

TEST(PlayOut, AcceptsAnyTimes) {
  Viewer viewer;
  viewer.learnClock();
  std::mt19937_64 random(3);
  const auto any = [&] { return random() >> (random() % 64); };
  for (std::uint64_t tick = 1; tick <= 3000; ++tick) {
    v1::Frame frame = viewer.server.frameMessage(tick, codec::PacketKind::predicted);
    frame.set_tick_time_us(any());
    frame.set_packet_time_us(any());
    viewer.client.receive(ScriptedServer::serialise(frame), tick * kFrameUs);
    viewer.play(tick * kFrameUs, any());
    for (const float value : viewer.playedPositions()) ASSERT_TRUE(std::isfinite(value));
    for (const float value : viewer.playedNormals()) ASSERT_TRUE(std::isfinite(value));
    for (const float value : viewer.playedCollider(7).position) ASSERT_TRUE(std::isfinite(value));
    for (const float value : viewer.playedCollider(7).orientation) ASSERT_TRUE(std::isfinite(value));
    viewer.stages();
  }
}

}  // namespace
}  // namespace clothstream::client
