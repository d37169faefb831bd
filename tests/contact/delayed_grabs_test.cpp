// SPDX-License-Identifier: MIT
// Grabs on a waving flag over a link with a round trip of 150 ms. The user takes hold of what a frame has
// shown, which the server had simulated 13 ticks before it hears of the grab: 75 ms of the way down, 35 ms of
// play-out and one tick of the frame, and 75 ms of the way up are 13.4 ticks.
#include <cstddef>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "server/model/mesh.h"
#include "tests/serving/scene/hosted_scene.h"

namespace clothstream::tests {
namespace {

using model::Vec3;

constexpr std::size_t kTicksAgo = 13;
constexpr int kGrabs = 100;
constexpr float kNear = 0.03f;  // m, radius of a grab

class DelayedGrabs : public GpuTest {};

// Returns how many of 100 grabs hold cloth after half a second, and have the seen place at the hand.
int heldOf100(bool withPlace) {
  const auto scene = messages::loadScene("flag");
  EXPECT_TRUE(scene);
  if (!scene) return 0;
  const model::Cloth& cloth = scene->cloths[0];
  HostedScene hosted(*scene);
  std::deque<std::vector<float>> shown;
  const auto tick = [&] {
    hosted.tick();
    shown.emplace_back(hosted.decoder->positions().begin(), hosted.decoder->positions().end());
    if (shown.size() > kTicksAgo + 1) shown.pop_front();
  };
  for (int i = 0; i < 144; ++i) tick();
  std::mt19937 random(5);
  int held = 0;
  for (std::uint32_t id = 1; id <= kGrabs; ++id) {
    model::ClothPoint point{.triangle = static_cast<std::uint32_t>(random() % model::triangleCount(cloth)),
                            .second = 0.3f,
                            .third = 0.3f};
    const model::Triangle corners = model::triangleAt(cloth, point.triangle);
    const auto placeIn = [&](const std::vector<float>& positions) {
      const float weights[] = {0.4f, 0.3f, 0.3f};
      Vec3 place = Vec3::Zero();
      for (std::size_t i = 0; i < 3; ++i)
        place += weights[i] * Eigen::Map<const Vec3>(positions.data() + 3 * corners[i]);
      return place;
    };
    const Vec3 seen = placeIn(shown.front());
    model::Grab grab{.id = id, .pose = {seen, model::Quaternion::Identity()}};
    if (withPlace) grab.place = model::GrabPlace{.point = point, .seenTick = hosted.host.tick() - kTicksAgo};
    hosted.live.inbox.postPoses(7, {.grabs = {grab}}, hosted.now);
    hosted.announced.clear();
    for (int i = 0; i < 36; ++i) tick();
    std::uint32_t vertices = 0;
    for (const v1::ServerMessage& message : hosted.announced)
      for (const v1::GrabEvent& event : message.tick_events().grabs())
        if (event.grab_id() == id) vertices = event.vertices();
    held += vertices > 0 && (placeIn(shown.back()) - seen).norm() <= kNear ? 1 : 0;
    hosted.live.inbox.postPoses(7, {}, hosted.now);
    for (int i = 0; i < 10; ++i) tick();
  }
  return held;
}

TEST_F(DelayedGrabs, HoldTheClothIfTheyNameTheirPlace) {
  const int without = heldOf100(false), with = heldOf100(true);
  fmt::print("{} of {} grabs hold with a place, {} without\n", with, kGrabs, without);
  EXPECT_GE(with, 95);
  EXPECT_LT(without, with);
}

}  // namespace
}  // namespace clothstream::tests
