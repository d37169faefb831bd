// SPDX-License-Identifier: MIT
// Contact of a moving point with each shape, compared with simple geometry.
#include "server/reference/contact.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

namespace clothstream::reference {
namespace {

const ColliderStep kStill{};

std::optional<Contact> touch(const model::Shape& shape, const Vec3& from, const Vec3& to) {
  return contactOf(shape, 0, kStill, from, to);
}

void expectContact(const std::optional<Contact>& contact, const Vec3& normal, double depth) {
  ASSERT_TRUE(contact);
  EXPECT_LT((contact->normal - normal).norm(), 1e-6) << contact->normal.transpose();
  EXPECT_NEAR(contact->depth, depth, 1e-6);
}

const model::Shape kCapsule = model::Capsule{.radius = 1, .length = 4};
const model::Shape kBox = model::Box{model::Vec3(2, 4, 6)};

TEST(ReferenceContact, LeavesARoundShapeByTheNearestWay) {
  expectContact(touch(model::Sphere{1}, Vec3(0, 0.9, 0), Vec3(0, 0.8, 0)), Vec3::UnitY(), 0.2);
  expectContact(touch(kCapsule, Vec3(0.9, 1.5, 0), Vec3(0.7, 1.5, 0)), Vec3::UnitX(), 0.3);
  expectContact(touch(kCapsule, Vec3(0, 2.9, 0), Vec3(0, 2.5, 0)), Vec3::UnitY(), 0.5);
}

TEST(ReferenceContact, StaysOnTheSideOfItsStart) {
  expectContact(touch(model::Sphere{1}, Vec3(0, 3, 0), Vec3(0, -0.8, 0)), Vec3::UnitY(), 1.8);
  expectContact(touch(model::Sphere{1}, Vec3(0, 3, 0), Vec3(0, -5, 0)), Vec3::UnitY(), 6);
  expectContact(touch(kCapsule, Vec3(4, 1, 0), Vec3(-4, 1, 0)), Vec3::UnitX(), 5);
  expectContact(touch(kCapsule, Vec3(0, 9, 0), Vec3(0, -9, 0)), Vec3::UnitY(), 12);
  expectContact(touch(kBox, Vec3(0.5, 0, 9), Vec3(0.5, 0, -9)), Vec3::UnitZ(), 12);
  expectContact(touch(model::Plane{}, Vec3(0, 2, 0), Vec3(5, -3, 0)), Vec3::UnitY(), 3);
}

TEST(ReferenceContact, MeetsTheEndOfACapsule) {
  // Through the round end, 0.6 off its axis: it enters 0.8 above the end's centre.
  expectContact(touch(kCapsule, Vec3(0.6, 9, 0), Vec3(0.6, -9, 0)), Vec3(0.6, 0.8, 0), 1 - 0.36 + 8.8);
}

const model::Shape kLimb = model::Capsule{.radius = 0.5f, .length = 2, .topRadius = 1.5f};

// A point is as far from the convex hull of two balls as from the nearest of the balls between them.
TEST(ReferenceContact, IsTheHullOfTwoBalls) {
  for (const double x : {0.0, 0.3, 1.0, 2.5})
    for (double y = -3; y <= 4; y += 0.25) {
      double nearest = INFINITY;
      for (int k = 0; k <= 2000; ++k) {
        const double t = k / 1000.0;
        nearest = std::min(nearest, std::hypot(x, y + 1 - t) - (0.5 + 0.5 * t));
      }
      const double turn = 0.7 * y;
      const Vec3 place(x * std::cos(turn), y, x * std::sin(turn));
      EXPECT_NEAR(heightOver(kLimb, Pose{}, place), nearest, 1e-6) << x << ", " << y;
    }
}

TEST(ReferenceContact, MeetsATaperedCapsule) {
  // The mantle leans by 30 degrees: its normal points down by as much.
  const Vec3 down(std::sqrt(0.75), -0.5, 0);
  const Vec3 surface = Vec3(0, 0.25, 0) + 1.125 * down;  // on the ball that is 1.25 above the lower end
  expectContact(touch(kLimb, surface + down, surface - 0.1 * down), down, 0.1);
  expectContact(touch(kLimb, surface - 0.1 * down, surface - 0.2 * down), down, 0.2);
  expectContact(touch(kLimb, Vec3(0, 9, 0), Vec3(0, 2, 0)), Vec3::UnitY(), 0.5);
  expectContact(touch(kLimb, Vec3(0, -9, 0), Vec3(0, -1, 0)), -Vec3::UnitY(), 0.5);
  EXPECT_FALSE(touch(kLimb, surface + 0.1 * down + Vec3(0.5, std::sqrt(0.75), 0),
                     surface + 0.1 * down - Vec3(0.5, std::sqrt(0.75), 0)));
}

TEST(ReferenceContact, IgnoresAPassingNode) {
  EXPECT_FALSE(touch(model::Sphere{1}, Vec3(1.01, 3, 0), Vec3(1.01, -3, 0)));
  EXPECT_FALSE(touch(model::Sphere{1}, Vec3(0, 3, 0), Vec3(0, 1.01, 0)));
  EXPECT_FALSE(touch(kCapsule, Vec3(4, 3.1, 0), Vec3(-4, 3.1, 0)));
  EXPECT_FALSE(touch(kBox, Vec3(1.5, 0, 9), Vec3(1.5, 0, -9)));
  EXPECT_FALSE(touch(kBox, Vec3(3, 0, 0), Vec3(0, 5, 0)));  // across the corner outside
}

TEST(ReferenceContact, IgnoresALeavingNode) {
  EXPECT_FALSE(touch(model::Sphere{1}, Vec3(0, 0.9, 0), Vec3(0, 1.1, 0)));
  EXPECT_FALSE(touch(kBox, Vec3(0.9, 0, 0), Vec3(1.1, 0, 0)));
}

TEST(ReferenceContact, LeavesABoxByTheFaceNearestToItsStart) {
  expectContact(touch(kBox, Vec3(0, 1.9, 0), Vec3(0.95, 1.8, 0)), Vec3::UnitY(), 0.2);
}

TEST(ReferenceContact, KeepsTheClothsThickness) {
  expectContact(contactOf(kBox, 0.1, kStill, Vec3(2, 0, 0), Vec3(1.05, 0, 0)), Vec3::UnitX(), 0.05);
  expectContact(contactOf(kCapsule, 0.1, kStill, Vec3(2, 0, 0), Vec3(1.05, 0, 0)), Vec3::UnitX(), 0.05);
}

TEST(ReferenceContact, FollowsTheMotionAndRotationOfTheShape) {
  // The box moves to the point, which rests.
  ColliderStep step;
  step.before = {Vec3(-5, 0, 0), Quaternion::Identity()};
  step.after = {Vec3(5, 0, 0), Quaternion::Identity()};
  expectContact(contactOf(kBox, 0, step, Vec3::Zero(), Vec3::Zero()), Vec3::UnitX(), 6);
  // A rod rotates by 90 degrees and sweeps over the point. In the frame of the rod the point moves from Y to
  // X.
  const model::Shape rod = model::Capsule{.radius = 0.1f, .length = 4};
  const double half = std::sqrt(0.5);
  step.before = {Vec3::Zero(), Quaternion(half, 0, 0, half)};  // along -X
  step.after = {Vec3::Zero(), Quaternion::Identity()};         // along Y
  const std::optional<Contact> swept = contactOf(rod, 0, step, Vec3(1, 1.2, 0), Vec3(-0.5, 1.2, 0));
  ASSERT_TRUE(swept);
  EXPECT_GT(swept->normal.x(), 0.9);
}

TEST(ReferenceSteps, FollowEachOtherFromStartToEnd) {
  const Pose start{Vec3(1, 0, 0), Quaternion::Identity()};
  const Pose end{Vec3(2, 0, 0), Quaternion(Eigen::AngleAxisd(0.2, Vec3::UnitZ()))};
  const ColliderStep first = stepOf(start, end, 0, 4, 0.1), last = stepOf(start, end, 3, 4, 0.1);
  EXPECT_EQ(first.before.position, start.position);
  EXPECT_EQ(last.after.position, end.position);
  EXPECT_LT((last.after.orientation.coeffs() - end.orientation.coeffs()).norm(), 1e-12);
  EXPECT_LT((first.velocity - Vec3(10, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(first.spin.z(), 2, 0.01);
}

}  // namespace
}  // namespace clothstream::reference
