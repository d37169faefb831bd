// SPDX-License-Identifier: MIT
#include "server/model/crowding.h"

#include <vector>

#include <gtest/gtest.h>

#include "server/model/price.h"
#include "tests/model/meshes.h"

namespace clothstream::model {
namespace {

// `count` cloths of 12 x 12 nodes with `nothingPasses`, `apart` metres from each other.
Scene stack(std::size_t count, float apart) {
  Scene scene;
  for (std::size_t i = 0; i < count; ++i) {
    Cloth cloth = grid(12, 12);
    cloth.grid.pose.position = {0, 0, apart * static_cast<float>(i)};
    cloth.selfCollision = SelfCollision{.radius = 0.01f, .friction = 0, .nothingPasses = true};
    scene.cloths.push_back(cloth);
  }
  return scene;
}

TEST(Crowding, IsTheMeanNumberOfPointsInACell) {
  EXPECT_EQ(crowding({}, 1), 0);
  EXPECT_EQ(crowding({{0.5f, 0.5f, 0.5f}, {1.5f, 0.5f, 0.5f}, {0.5f, -0.5f, 0.5f}}, 1), 1);
  // Three in one cell, one in another.
  EXPECT_EQ(crowding({{0.1f, 0, 0}, {0.2f, 0, 0}, {0.3f, 0, 0}, {9, 0, 0}}, 1), 10.0 / 4);
  EXPECT_EQ(crowding({{1e9f, 0, 0}, {2e9f, 0, 0}}, 1), 2);
}

TEST(Crowding, GrowsWithClothsInOnePlaceAndNotWithClothsSideBySide) {
  const SceneCrowding one = crowdingOf(stack(1, 1)), apart = crowdingOf(stack(20, 1)),
                      together = crowdingOf(stack(20, 0));
  EXPECT_NEAR(apart.balls, one.balls, 1e-9);
  EXPECT_NEAR(apart.triangles, one.triangles, 1e-9);
  EXPECT_NEAR(together.balls, 20 * one.balls, 1e-9);
  EXPECT_NEAR(together.triangles, 20 * one.triangles, 1e-9);
}

TEST(Crowding, RaisesThePriceOfWhatHasToBeSearched) {
  const auto nodeSteps = [](const Scene& scene) { return PriceModel(scene).work(scene).nodeSteps; };
  const Scene apart = stack(64, 1), together = stack(64, 0);
  EXPECT_GT(nodeSteps(together), 10 * nodeSteps(apart));
  // A stack of a few layers is what the weights are fitted to.
  EXPECT_EQ(nodeSteps(stack(2, 0.02f)), nodeSteps(stack(2, 1)));
}

}  // namespace
}  // namespace clothstream::model
