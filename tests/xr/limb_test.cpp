// SPDX-License-Identifier: MIT
#include "clients/xr/input/limb.h"

#include <limits>

#include <gtest/gtest.h>

#include "tests/xr/hand_samples.h"

namespace clothstream::xr {
namespace {

constexpr float kOpen = 0.06f, kClosed = 0.01f, kBetween = 0.025f;  // distances of the finger tips, m

class XrLimb : public testing::Test {
 protected:
  void update() { limb.update(sample, &head, toScene, nowUs += 11'000); }

  Limb limb{Side::right};
  LimbSample sample;
  Pose head{{0, 1.6f, 0}, Eigen::Quaternionf::Identity()};
  Pose toScene;
  std::uint64_t nowUs = 1'000'000;
};

TEST_F(XrLimb, TremblingPinchStaysPressed) {
  giveHand(sample, {0, 1, 0}, kBetween);
  update();
  EXPECT_FALSE(limb.pressed());
  giveHand(sample, {0, 1, 0}, kClosed);
  update();
  EXPECT_TRUE(limb.pressed());
  EXPECT_TRUE(limb.isNew());
  giveHand(sample, {0, 1, 0}, kBetween);
  update();
  EXPECT_TRUE(limb.pressed());
  EXPECT_FALSE(limb.isNew());
  giveHand(sample, {0, 1, 0}, kOpen);
  update();
  EXPECT_FALSE(limb.pressed());
}

TEST_F(XrLimb, LostHandKeepsItsPoseFor300Milliseconds) {
  giveHand(sample, {0, 1, 0}, kClosed);
  update();
  const std::uint64_t seenUs = nowUs;
  sample.hasHand = false;
  while (nowUs + 11'000 <= seenUs + 300'000) {
    update();
    ASSERT_TRUE(limb.present());
    EXPECT_FALSE(limb.seen());
    EXPECT_TRUE(limb.pressed());
    EXPECT_TRUE(limb.grip().position.isApprox(Eigen::Vector3f(0, 1, 0)));
  }
  update();
  EXPECT_FALSE(limb.present());
  EXPECT_FALSE(limb.pressed());
}

TEST_F(XrLimb, ControllerHasPriorityAndSwitchesBothWaysAtOnce) {
  giveHand(sample, {0, 1, 0}, kClosed);
  update();
  EXPECT_EQ(limb.kind(), LimbKind::hand);
  giveController(sample, {1, 1, 0});
  update();
  EXPECT_EQ(limb.kind(), LimbKind::controller);
  EXPECT_FALSE(limb.pressed()) << "the pinch belonged to the hand";
  EXPECT_TRUE(limb.grip().position.isApprox(Eigen::Vector3f(1, 1, 0)));
  sample.hasController = false;
  update();
  EXPECT_EQ(limb.kind(), LimbKind::hand);
  EXPECT_TRUE(limb.isNew());
}

TEST_F(XrLimb, PressAfterASwitchIsNew) {
  giveHand(sample, {0, 1, 0}, kClosed);
  update();
  giveController(sample, {1, 1, 0});
  sample.trigger = 1;
  update();
  EXPECT_TRUE(limb.pressed());
  EXPECT_TRUE(limb.isNew());
}

TEST_F(XrLimb, ImpossibleJointsCountAsLost) {
  giveHand(sample, {0, 1, 0}, kOpen);
  sample.joints[3].position.x() = std::numeric_limits<float>::quiet_NaN();
  update();
  EXPECT_FALSE(limb.present());
  giveHand(sample, {0, 1, 0}, kOpen);
  sample.joints[3].radius = 0;
  update();
  EXPECT_FALSE(limb.present());
}

TEST_F(XrLimb, SqueezePressesButDoesNotPoint) {
  giveController(sample, {0, 1, 0});
  sample.squeeze = 1;
  update();
  EXPECT_TRUE(limb.isNew());
  EXPECT_FALSE(limb.points());
  sample.trigger = 1;
  update();
  EXPECT_TRUE(limb.points());
}

TEST_F(XrLimb, RayAndGripAreInTheScene) {
  toScene = {{0, 0, -2}, Eigen::Quaternionf(Eigen::AngleAxisf(kPi / 2, Eigen::Vector3f::UnitY()))};
  giveController(sample, {1, 1, 0});
  update();
  EXPECT_TRUE(limb.grip().position.isApprox(Eigen::Vector3f(0, 1, -3), 1e-5f));
  EXPECT_TRUE(limb.ray().direction.isApprox(Eigen::Vector3f(-1, 0, 0), 1e-5f));
}

TEST_F(XrLimb, HandWithoutRayPointsAwayFromTheShoulder) {
  giveHand(sample, {0.2f, 1.4f, -0.5f}, kOpen);
  update();
  ASSERT_TRUE(limb.hasRay());
  EXPECT_NEAR(limb.ray().direction.norm(), 1, 1e-5f);
  EXPECT_LT(limb.ray().direction.z(), -0.9f);
}

}  // namespace
}  // namespace clothstream::xr
