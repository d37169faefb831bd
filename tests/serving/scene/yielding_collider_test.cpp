// SPDX-License-Identifier: MIT
// A participant's collider presses cloth that nothing passes through.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/serving/scene/hosted_scene.h"

namespace clothstream::scene {
namespace {

using model::Vec3;

class YieldingCollider : public tests::GpuTest {};

// Three sheets of 9x9 nodes lie on the ground, in layers of 2 cm.
model::Scene layersOnGround(bool nothingPasses) {
  model::Scene scene;
  scene.name = "layers";
  for (int i = 0; i < 3; ++i) {
    model::Cloth& cloth = scene.cloths.emplace_back();
    cloth.name = "layer" + std::to_string(i);
    cloth.grid.rows = cloth.grid.columns = 9;
    cloth.grid.width = cloth.grid.height = 0.16f;
    cloth.grid.pose.position = Vec3(0, 0.006f + 0.02f * static_cast<float>(i), -0.1f);
    cloth.grid.pose.orientation = model::Quaternion(Eigen::AngleAxisf(1.5707963f, Vec3::UnitX()));
    cloth.mass = 0.4f;
    cloth.structural = {50, 0.05f};
    cloth.shear = {25, 0.02f};
    cloth.damping = 1;
    cloth.selfCollision = model::SelfCollision{.radius = 0.01f, .nothingPasses = nothingPasses};
  }
  model::Collider ground;
  ground.name = "ground";
  ground.shape = model::Plane{};
  scene.colliders = {ground};
  return scene;
}

struct Press {
  float lowest = 1e30f;  // of the lower side of the plate, m
  bool yields = false;
  v1::ColliderState last;
};

// A plate with its lower side at `from` m goes to `to` m within `ticks` ticks, and stays for as long.
Press press(tests::HostedScene& hosted, float from, float to, int ticks) {
  Press press;
  for (int tick = 0; tick < 2 * ticks; ++tick) {
    const float part = std::min(static_cast<float>(tick + 1) / static_cast<float>(ticks), 1.0f);
    const model::Pose pose{Vec3(0, 0.05f + from + part * (to - from), 0), model::Quaternion::Identity()};
    hosted.live.inbox.postPoses(7, {.colliders = {{1, pose, model::Box{Vec3(0.4f, 0.1f, 0.4f)}}}},
                                hosted.now);
    hosted.tick();
    press.last = hosted.frames.back().colliders(1);
    press.lowest = std::min(press.lowest, press.last.position().y() - 0.05f);
    press.yields = press.yields || press.last.yields();
  }
  return press;
}

TEST_F(YieldingCollider, StopsBeforeLayersThatHaveNoRoomAndSaysSo) {
  tests::HostedScene hosted(layersOnGround(true));
  const Press pressed = press(hosted, 0.12f, -0.02f, 20);
  EXPECT_TRUE(pressed.yields);
  EXPECT_TRUE(pressed.last.yields());
  EXPECT_GT(pressed.last.position().y() - 0.05f, -0.008f);
  const Press lifted = press(hosted, -0.02f, 0.2f, 20);
  EXPECT_FALSE(lifted.last.yields());
  EXPECT_NEAR(lifted.last.position().y(), 0.25, 1e-4);
}

TEST_F(YieldingCollider, GoesThroughClothWithoutTheSetting) {
  tests::HostedScene hosted(layersOnGround(false));
  const Press pressed = press(hosted, 0.12f, -0.02f, 20);
  EXPECT_FALSE(pressed.yields);
  EXPECT_NEAR(pressed.last.position().y() - 0.05f, -0.02, 1e-4);
}

}  // namespace
}  // namespace clothstream::scene
