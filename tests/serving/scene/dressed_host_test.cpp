// SPDX-License-Identifier: MIT
// Cloth that follows joints, in a scene host whose state goes back.
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/model/cloth_skin.h"
#include "server/scene/scene_host.h"
#include "server/scene/scene_on_device.h"
#include "tests/model/solids.h"
#include "tests/serving/scene/hosted_scene.h"

namespace clothstream::scene {
namespace {

constexpr float kSpeed = 2;  // m/s, of the figure along X

// A sheet follows a rod that moves away steadily, far above it. Its first row is held by the rod, and nothing
// limits the others, which hang.
model::Scene walkingScene() {
  model::Scene scene = tests::smallScene();
  model::ClosedMesh rod = *model::rodMesh(0.03f, 0.4f, 4, 4);
  for (model::Vec3& vertex : rod.vertices) vertex.y() += 5;
  model::Skin joints{.joints = {{"root", std::nullopt, {}}}, .vertices = {}, .keys = {}};
  joints.vertices.assign(rod.vertices.size(), {{0, 0, 0, 0}, {1, 0, 0, 0}});
  rod.skin = joints;
  model::Collider figure{.name = "figure", .shape = std::make_shared<const model::ClosedMesh>(rod)};
  figure.motion = {.keys = {{0, {0, 0, 0}}, {10, {10 * kSpeed, 0, 0}}}, .steady = true};
  model::Cloth& cloth = scene.cloths[0];
  cloth.pins.clear();
  auto skin = std::make_shared<model::ClothSkin>();
  skin->collider = figure.name;
  skin->joints.assign(cloth.nodeCount(), {{0, 0, 0, 0}, {1, 0, 0, 0}});
  skin->limits.resize(cloth.nodeCount());
  for (std::uint32_t node = 0; node < cloth.grid.columns; ++node) skin->limits[node].maxDistance = 0;
  model::complete(*skin, cloth, figure);
  cloth.skin = std::move(skin);
  scene.colliders = {figure};
  return scene;
}

class DressedHostTest : public tests::GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    if (!IsSkipped()) hosted = std::make_unique<tests::HostedScene>(walkingScene());
  }
  // The held row is at the figure, and what hangs swings behind it by less than the sheet's diagonal.
  void expectClothAtFigure() const {
    const float figure = kSpeed * static_cast<float>(hosted->host.tick()) / 40;
    const simulation::TickStatus status = hosted->host.status();
    EXPECT_TRUE(status.healthy);
    EXPECT_NEAR(status.high.x(), figure + 0.45f, 0.2f);
    EXPECT_GT(status.low.x(), figure - 0.45f - 1.5f);
    EXPECT_EQ(hosted->live.metrics.rollbacks.value() + hosted->live.metrics.resets.value(),
              expectedRecoveries);
  }
  void expectClothAtFigureForTicks(int count) {
    for (int tick = 0; tick < count && !HasFailure(); ++tick) {
      hosted->tick();
      expectClothAtFigure();
    }
  }

  std::unique_ptr<tests::HostedScene> hosted;
  std::uint64_t expectedRecoveries = 0;
};

TEST_F(DressedHostTest, AResetTakesTheClothFromItsStartToTheFigure) {
  hosted->ticks(60);
  expectClothAtFigure();
  hosted->live.resetRequested = true;
  expectClothAtFigureForTicks(20);
}

TEST_F(DressedHostTest, ARollbackTakesTheClothAlongSinceItsCheckpoint) {
  hosted->ticks(75);  // the newest checkpoint is that of tick 40
  hosted->change(tests::gravity(-1e6f));
  hosted->tick();
  ASSERT_FALSE(hosted->host.status().healthy);
  expectedRecoveries = 1;
  hosted->change(tests::gravity(-9.81f));
  expectClothAtFigureForTicks(20);
}

TEST_F(DressedHostTest, ALostDeviceTakesTheClothAlongSinceItsSnapshot) {
  hosted->ticks(60);
  hosted->host.release();
  hosted->host.rebuild(
      std::make_unique<SceneOnDevice>(tests::device(), hosted->live.start(), hosted->publisher.workers()),
      "a test");
  expectClothAtFigureForTicks(20);
}

}  // namespace
}  // namespace clothstream::scene
