// SPDX-License-Identifier: MIT
// Winds of participants from tick to tick.
#include "server/scene/held_winds.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::scene {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class HeldWindsTest : public ::testing::Test {
 protected:
  void place(std::uint64_t participant, const std::vector<float>& each) {
    std::vector<model::HeldWind> placed;
    for (const float speed : each)
      placed.push_back({{.speed = speed}, static_cast<std::uint32_t>(placed.size())});
    held.place(participant, placed);
  }
  std::vector<float> speeds(float room = 1000) {
    held.advance(scene, room, winds);
    std::vector<float> all;
    for (const model::LocalWind& wind : winds) all.push_back(wind.speed);
    return all;
  }
  model::Scene scene;
  HeldWinds held;
  std::vector<model::LocalWind> winds;
};

TEST_F(HeldWindsTest, FollowThoseOfTheScene) {
  EXPECT_THAT(speeds(), IsEmpty());
  scene.winds = {{{.speed = 9}, "fan"}};
  place(8, {3});
  place(7, {1, 2});
  EXPECT_THAT(speeds(), ElementsAre(9, 1, 2, 3));
  place(7, {4});
  EXPECT_THAT(speeds(), ElementsAre(9, 4, 3));
  place(8, {});
  EXPECT_THAT(speeds(), ElementsAre(9, 4));
  held.letGo();
  EXPECT_TRUE(held.empty());
  EXPECT_THAT(speeds(), ElementsAre(9));
}

TEST_F(HeldWindsTest, AreSlowedToTheRoom) {
  scene.winds = {{{.speed = 9}, "fan"}};
  place(7, {10, 20});
  place(8, {10});
  EXPECT_THAT(speeds(40), ElementsAre(9, 10, 20, 10));
  EXPECT_THAT(speeds(10), ElementsAre(9, 2.5f, 5, 2.5f));
  EXPECT_THAT(speeds(0), ElementsAre(9, 0, 0, 0));
}

TEST_F(HeldWindsTest, AreNoMoreThanTheTickHas) {
  scene.winds.resize(7);
  place(7, {1, 2});
  EXPECT_EQ(speeds().size(), model::kMaxLocalWinds);
}

}  // namespace
}  // namespace clothstream::scene
