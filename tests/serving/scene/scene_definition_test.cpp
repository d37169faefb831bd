// SPDX-License-Identifier: MIT
#include "server/scene/scene_definition.h"

#include <utility>

#include <gtest/gtest.h>

#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using tests::smallScene;

TEST(SceneDefinition, ForgetsTheDescriptionWithEachChange) {
  SceneDefinition definition(smallScene());
  EXPECT_EQ(definition.description(), nullptr);
  const auto first = definition.describe("rest");
  EXPECT_EQ(definition.description(), first);
  const std::uint64_t version = definition.version();
  model::Scene windy = definition.start();
  windy.environment.wind.x() = 3;
  definition.change(std::move(windy));
  EXPECT_EQ(definition.accepted().environment.wind.x(), 3);
  EXPECT_EQ(definition.start().environment.wind.x(), 0);
  EXPECT_NE(definition.version(), version);
  EXPECT_EQ(definition.description(), nullptr);
  EXPECT_NE(definition.describe("rest")->contentId(), first->contentId());
}

TEST(SceneDefinition, GivesNoContentIdOfEarlierRuns) {
  SceneDefinition former(smallScene()), restored(smallScene());
  former.restore(smallScene());
  restored.restore(smallScene());
  EXPECT_NE(restored.describe("rest")->contentId(), former.describe("rest")->contentId());
}

TEST(SceneDefinition, NeedsNoMoreSubstepsThanItsStart) {
  const SceneDefinition definition(smallScene());
  EXPECT_LE(definition.leastSubsteps(definition.start()), definition.start().substeps);
  model::Scene stiff = definition.start();
  stiff.cloths[0].structural.stiffness = 1e9f;
  EXPECT_EQ(definition.leastSubsteps(stiff), definition.start().substeps);
}

}  // namespace
}  // namespace clothstream::scene
