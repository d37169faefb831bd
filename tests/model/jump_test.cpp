// SPDX-License-Identifier: MIT
// Motions that count as jumps, and cloths that go along.
#include "server/model/jump.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "server/model/cloth_skin.h"

namespace clothstream::model {
namespace {

constexpr double kTick = 1.0 / 72;
constexpr float kReach = 30.0f / 72;  // m, the longest way in a tick that is no jump

Pose at(float x, float degrees = 0) {
  return {Vec3(x, 0, 0), Quaternion(Eigen::AngleAxisf(degrees * std::acos(-1.0f) / 180, Vec3::UnitY()))};
}

TEST(Jump, StartsBeyondThirtyMetresPerSecond) {
  EXPECT_FALSE(hasJumped(at(1), at(1 + 0.99f * kReach), kTick));
  EXPECT_TRUE(hasJumped(at(1), at(1 + 1.01f * kReach), kTick));
  EXPECT_FALSE(hasJumped(at(1), at(1 + 1.01f * kReach), 2 * kTick));
}

TEST(Jump, StartsBeyondAThirdOfATurn) {
  EXPECT_FALSE(hasJumped(at(0), at(0, 119), kTick));
  EXPECT_TRUE(hasJumped(at(0), at(0, 121), kTick));
  // The surface moves at most twice as fast as the middle may.
  EXPECT_FALSE(hasJumped(at(0), at(0, 90), kTick, 0.5f));
  EXPECT_TRUE(hasJumped(at(0), at(0, 90), kTick, 0.6f));
}

TEST(Jump, CountsIfOnePoseJumps) {
  const std::vector<Pose> before = {at(0), at(1)}, calm = {at(0.1f), at(1.1f)}, jumped = {at(0.1f), at(3)};
  EXPECT_FALSE(hasJumped(before, calm, kTick));
  EXPECT_TRUE(hasJumped(before, jumped, kTick));
}

// A cloth without attachments, then one with two.
Scene twoCloths() {
  Scene scene;
  scene.cloths.resize(2);
  scene.cloths[1].attachments.resize(2);
  return scene;
}

TEST(Carry, TakesAClothWhoseAttachmentsJumpTogether) {
  const Scene scene = twoCloths();
  EXPECT_TRUE(carriesOf(scene, std::vector{at(0), at(1)}, std::vector{at(0.2f), at(1.2f)}).empty());
  const auto carries = carriesOf(scene, std::vector{at(0), at(1)}, std::vector{at(5), at(6.1f)});
  ASSERT_EQ(carries.size(), 1u);
  EXPECT_EQ(carries[0].cloth, 1u);
  EXPECT_EQ(carries[0].from.position, at(0).position);
  EXPECT_EQ(carries[0].to.position, at(5).position);
}

// The second attachment turns around the first.
TEST(Carry, TurnsAroundTheFirstAttachment) {
  const Scene scene = twoCloths();
  const Pose around{Vec3(0, 0, -1), at(0, 90).orientation};
  EXPECT_EQ(carriesOf(scene, std::vector{at(0), at(1)}, std::vector{at(0, 90), around}).size(), 0u);
  const Pose further{Vec3(-1, 0, 0), at(0, 180).orientation};
  EXPECT_EQ(carriesOf(scene, std::vector{at(0), at(1)}, std::vector{at(0, 180), further}).size(), 1u);
}

TEST(Carry, LeavesAClothThatIsHeldElsewhere) {
  Scene scene = twoCloths();
  const std::vector before = {at(0), at(1)};
  EXPECT_TRUE(carriesOf(scene, before, std::vector{at(5), at(1)}).empty());
  EXPECT_TRUE(carriesOf(scene, before, std::vector{at(0), at(6)}).empty());
  const std::vector together = {at(5), at(6)};
  for (const auto& pin : std::vector<void (*)(Cloth&)>{
           [](Cloth& cloth) { cloth.pins.emplace_back(); }, [](Cloth& cloth) { cloth.pinnedVertices = {3}; },
           [](Cloth& cloth) { cloth.pinnedRegions.emplace_back(); }}) {
    Scene pinned = scene;
    pin(pinned.cloths[1]);
    EXPECT_TRUE(carriesOf(pinned, before, together).empty());
  }
}

// Its joints take it along, and it would go twice as far.
TEST(Carry, LeavesAClothThatFollowsJoints) {
  Scene scene = twoCloths();
  const std::vector before = {at(0), at(1)}, together = {at(5), at(6)};
  ASSERT_EQ(carriesOf(scene, before, together).size(), 1u);
  scene.cloths[1].skin = std::make_shared<const ClothSkin>();
  EXPECT_TRUE(carriesOf(scene, before, together).empty());
}

}  // namespace
}  // namespace clothstream::model
