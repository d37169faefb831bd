// SPDX-License-Identifier: MIT
#include "clients/xr/input/touch.h"

#include <cmath>

#include <gtest/gtest.h>

#include "clients/xr/input/haptics.h"
#include "tests/xr/hand_samples.h"

namespace clothstream::xr {
namespace {

// A cloth in the plane z = 0.
class FlatCloth final : public Touchable {
 public:
  bool nearestPoint(const Eigen::Vector3f& point, float maxDistance, cs_cloth_point& out) const override {
    if (std::abs(point.z()) > maxDistance) return false;
    give({point.x(), point.y(), 0}, std::abs(point.z()), out);
    return true;
  }
  bool castRay(const Ray& ray, float maxDistance, cs_cloth_point& out) const override {
    const float distance = -ray.origin.z() / ray.direction.z();
    if (!(distance > 0) || distance > maxDistance) return false;
    give(ray.origin + distance * ray.direction, distance, out);
    return true;
  }

 private:
  static void give(const Eigen::Vector3f& at, float distance, cs_cloth_point& out) {
    out = {};
    Eigen::Map<Eigen::Vector3f>(out.position) = at;
    out.distance = distance;
    out.triangle = 7;
    out.tick = 42;
  }
};

class XrTouch : public testing::Test {
 protected:
  LimbSample& right() { return sample.limbs[indexOf(Side::right)]; }
  void frame() {
    touch.update(sample, toScene, nowUs += 11'000);
    touch.grab(cloth);
  }

  FlatCloth cloth;
  Touch touch;
  InputSample sample;
  Pose toScene;
  std::uint64_t nowUs = 1'000'000;
};

TEST_F(XrTouch, ControllersAreSpheresAndHandsAreJoints) {
  sample.hasHead = true;
  sample.head.position = {0, 1.6f, 0};
  giveController(right(), {0.2f, 1, -0.3f});
  giveHand(sample.limbs[indexOf(Side::left)], {-0.2f, 1, -0.3f}, 0.05f);
  frame();
  const OwnInput input = touch.input();
  EXPECT_TRUE(input.hasHead);
  EXPECT_FLOAT_EQ(input.head.position.y(), 1.6f);
  ASSERT_EQ(input.colliderCount, 1U);
  EXPECT_EQ(input.colliderSides[0], Side::right);
  EXPECT_EQ(input.colliders[0].shape, static_cast<std::uint32_t>(CS_SHAPE_SPHERE));
  EXPECT_FLOAT_EQ(input.colliders[0].radius, Touch::kControllerRadius);
  EXPECT_TRUE(input.hasHand[indexOf(Side::left)]);
  EXPECT_FALSE(input.hasHand[indexOf(Side::right)]);
  EXPECT_FLOAT_EQ(input.hands[indexOf(Side::left)][3], 0.008f);
}

TEST_F(XrTouch, ControllerDoesNotHoldWhatTheHandHeld) {
  giveHand(right(), {0.1f, 1, 0.05f}, 0.01f);
  frame();
  ASSERT_TRUE(touch.grabber(Side::right).holds());
  giveController(right(), {0.1f, 1, 2});
  right().squeeze = 1;
  frame();
  EXPECT_TRUE(touch.limb(Side::right).pressed());
  EXPECT_FALSE(touch.grabber(Side::right).holds());
}

TEST_F(XrTouch, SqueezeNamesSeenPlaceAndTurnsWithController) {
  giveController(right(), {0.1f, 1, 0.05f});
  right().squeeze = 1;
  frame();
  OwnInput input = touch.input();
  ASSERT_EQ(input.grabCount, 1U);
  const std::uint32_t id = input.grabs[0].id;
  ASSERT_NE(input.grabs[0].place, nullptr);
  EXPECT_EQ(input.grabs[0].place->triangle, 7U);
  EXPECT_EQ(input.grabs[0].place->tick, 42U);
  EXPECT_NEAR(input.grabs[0].position[2], 0, 1e-6f)
      << "the held place is on the cloth, not in the controller";
  // Half a turn around the vertical puts the held place behind the controller.
  right().grip.orientation = Eigen::AngleAxisf(kPi, Eigen::Vector3f::UnitY());
  frame();
  input = touch.input();
  ASSERT_EQ(input.grabCount, 1U);
  EXPECT_EQ(input.grabs[0].id, id);
  EXPECT_NEAR(input.grabs[0].position[2], 0.1f, 1e-5f);
  right().squeeze = 0;
  frame();
  EXPECT_EQ(touch.input().grabCount, 0U);
  right().squeeze = 1;
  right().grip.orientation.setIdentity();
  frame();
  EXPECT_NE(touch.input().grabs[0].id, id) << "a new grab has a new id";
}

TEST_F(XrTouch, TriggerTakesFarClothUnderTheRayAndSqueezeDoesNot) {
  giveController(right(), {0, 1, 1});
  right().squeeze = 1;
  frame();
  EXPECT_EQ(touch.input().grabCount, 0U);
  right().squeeze = 0;
  frame();
  right().trigger = 1;
  frame();
  ASSERT_EQ(touch.input().grabCount, 1U);
  right().aim.position.x() = right().grip.position.x() = 0.5f;
  frame();
  EXPECT_NEAR(touch.input().grabs[0].position[0], 0.5f, 1e-5f);
  EXPECT_NEAR(touch.input().grabs[0].position[2], 0, 1e-5f);
}

TEST_F(XrTouch, UsedPressTakesNoCloth) {
  giveController(right(), {0, 1, 0.05f});
  right().trigger = 1;
  touch.update(sample, toScene, nowUs);
  touch.use(Side::right);
  touch.grab(cloth);
  EXPECT_EQ(touch.input().grabCount, 0U);
  frame();
  EXPECT_EQ(touch.input().grabCount, 0U) << "a press that was used does not take hold later";
}

TEST_F(XrTouch, SlippedGrabEndsAndOnlyThatOne) {
  giveController(right(), {0, 1, 0.05f});
  right().squeeze = 1;
  frame();
  const std::uint32_t id = touch.input().grabs[0].id;
  touch.slipped(id + 1);
  EXPECT_EQ(touch.input().grabCount, 1U);
  touch.slipped(id);
  EXPECT_EQ(touch.input().grabCount, 0U);
}

TEST_F(XrTouch, GrabEndsWhenAHandIsLostForLong) {
  giveHand(right(), {0, 1, 0.05f}, 0.01f);
  frame();
  ASSERT_EQ(touch.input().grabCount, 1U);
  right().hasHand = false;
  nowUs += 250'000;
  frame();
  EXPECT_EQ(touch.input().grabCount, 1U);
  nowUs += 100'000;
  frame();
  EXPECT_EQ(touch.input().grabCount, 0U);
  EXPECT_FALSE(touch.input().hasHand[indexOf(Side::right)]);
}

TEST_F(XrTouch, HiddenSessionLeavesNothingInTheScene) {
  sample.hasHead = true;
  giveController(right(), {0, 1, 0.05f});
  right().squeeze = 1;
  frame();
  touch.leave();
  const OwnInput input = touch.input();
  EXPECT_FALSE(input.hasHead);
  EXPECT_EQ(input.colliderCount, 0U);
  EXPECT_EQ(input.grabCount, 0U);
}

class XrHaptics : public testing::Test {
 protected:
  XrHaptics() {
    input.colliderCount = 1;
    input.colliderSides[0] = Side::right;
    contact.kind = CS_CONTACT_BEGAN;
    contact.participant_id = 5;
    contact.impulse = 0.01f;
  }
  OwnInput input;
  cs_contact_event contact{};
};

TEST_F(XrHaptics, OwnControllerVibratesWithTheImpulse) {
  const auto pulse = pulseOf(contact, 5, input);
  ASSERT_TRUE(pulse);
  EXPECT_EQ(pulse->side, Side::right);
  EXPECT_NEAR(pulse->amplitude, 0.5f, 1e-5f);
  contact.impulse = 10;
  EXPECT_EQ(pulseOf(contact, 5, input)->amplitude, 1);
  contact.impulse = std::nanf("");
  EXPECT_GT(pulseOf(contact, 5, input)->amplitude, 0);
}

TEST_F(XrHaptics, OtherContactsDoNotVibrate) {
  EXPECT_FALSE(pulseOf(contact, 6, input));
  contact.collider_id = CS_HEAD_ID;
  EXPECT_FALSE(pulseOf(contact, 5, input));
  contact.collider_id = 0;
  contact.kind = CS_CONTACT_ENDED;
  EXPECT_FALSE(pulseOf(contact, 5, input));
}

}  // namespace
}  // namespace clothstream::xr
