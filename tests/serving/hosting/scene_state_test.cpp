// SPDX-License-Identifier: MIT
#include "server/hosting/scene_state.h"

#include <cstddef>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::hosting {
namespace {

using enum SceneState;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

std::vector<SceneState> allStates() {
  std::vector<SceneState> states;
  for (int i = 0; i < kSceneStates; ++i) states.push_back(static_cast<SceneState>(i));
  return states;
}

std::vector<SceneState> before(SceneState to) {
  std::vector<SceneState> states;
  for (const SceneState from : allStates())
    if (from != to && mayBecome(from, to)) states.push_back(from);
  return states;
}

std::vector<SceneState> after(SceneState from) {
  std::vector<SceneState> states;
  for (const SceneState to : allStates())
    if (from != to && mayBecome(from, to)) states.push_back(to);
  return states;
}

TEST(SceneState, EveryStateCanBeReached) {
  std::set<SceneState> reached{asleep};
  for (std::size_t count = 0; count < reached.size();) {
    count = reached.size();
    for (const SceneState from : std::set(reached)) {
      const std::vector<SceneState> next = after(from);
      reached.insert(next.begin(), next.end());
    }
  }
  EXPECT_EQ(reached.size(), kSceneStates);
}

TEST(SceneState, QuarantineIsFinal) {
  EXPECT_THAT(after(quarantined), IsEmpty());
}

TEST(SceneState, OnlyLoadingLeadsToTheDevice) {
  for (const SceneState to : allStates())
    for (const SceneState from : before(to))
      if (isOnDevice(to) && !isOnDevice(from)) {
        EXPECT_EQ(to, idle);
        EXPECT_TRUE(from == loading || from == prepared);
      }
  EXPECT_THAT(before(loading), UnorderedElementsAre(asleep, interrupted));
  EXPECT_THAT(before(prepared), UnorderedElementsAre(loading));
}

TEST(SceneState, OnlyRunningScenesBeginTicks) {
  EXPECT_THAT(before(inFlight), UnorderedElementsAre(running));
  EXPECT_THAT(before(betweenSlices), UnorderedElementsAre(inFlight));
}

// The device must have finished a slice before the scene may be released for good.
TEST(SceneState, NoSceneEndsWithASliceInFlight) {
  EXPECT_THAT(after(inFlight), UnorderedElementsAre(betweenSlices, running, interrupted));
}

TEST(SceneState, EverySceneOnTheDeviceCanLoseIt) {
  for (const SceneState state : allStates())
    EXPECT_EQ(mayBecome(state, interrupted), isOnDevice(state) || state == loading)
        << static_cast<int>(state);
}

TEST(SceneState, OnlyNewScenesAreRefused) {
  EXPECT_THAT(before(refused), UnorderedElementsAre(loading, prepared));
}

}  // namespace
}  // namespace clothstream::hosting
