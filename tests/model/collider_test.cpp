// SPDX-License-Identifier: MIT
// Motion of colliders between keys, and sizes of their shapes.
#include "server/model/collider.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace clothstream::model {
namespace {

Quaternion aboutY(double degrees) {
  const double half = degrees * std::acos(-1.0) / 360;
  return {static_cast<float>(std::cos(half)), 0, static_cast<float>(std::sin(half)), 0};
}

Collider moving() {
  Collider collider;
  collider.pose.position = Vec3(7, 7, 7);
  collider.motion.keys = {
      {0, Vec3(0, 0, 0), aboutY(0)}, {1, Vec3(4, 0, 0), aboutY(90)}, {4, Vec3(4, 8, 0), aboutY(0)}};
  return collider;
}

Vec3 positionAt(const Collider& collider, double seconds) {
  return poseAt(collider, seconds).position;
}

// Angle of a rotation about Y, degrees.
double angleAt(const Collider& collider, double seconds) {
  const Quaternion turn = poseAt(collider, seconds).orientation;
  EXPECT_NEAR(turn.norm(), 1, 1e-6);
  return std::atan2(double{turn.y()}, double{turn.w()}) * 360 / std::acos(-1.0);
}

TEST(PoseAt, ReturnsThePoseWithoutMotion) {
  Collider collider = moving();
  collider.motion.keys.clear();
  collider.pose.orientation = aboutY(30);
  EXPECT_EQ(positionAt(collider, 123.4), Vec3(7, 7, 7));
  EXPECT_EQ(poseAt(collider, 123.4).orientation.coeffs(), aboutY(30).coeffs());
}

TEST(PoseAt, InterpolatesKeysWithSmoothstep) {
  const Collider collider = moving();
  EXPECT_EQ(positionAt(collider, 0), Vec3(0, 0, 0));
  EXPECT_EQ(positionAt(collider, 0.5), Vec3(2, 0, 0));
  EXPECT_EQ(positionAt(collider, 0.25), Vec3(4 * 0.15625f, 0, 0));  // 3/16 - 2/64
  EXPECT_EQ(positionAt(collider, 1), Vec3(4, 0, 0));
  EXPECT_EQ(positionAt(collider, 2.5), Vec3(4, 4, 0));
}

TEST(PoseAt, InterpolatesOrientations) {
  const Collider collider = moving();
  EXPECT_NEAR(angleAt(collider, 0), 0, 1e-4);
  EXPECT_NEAR(angleAt(collider, 0.5), 45, 1e-4);
  EXPECT_NEAR(angleAt(collider, 1), 90, 1e-4);
  EXPECT_NEAR(angleAt(collider, 2.5), 45, 1e-4);
}

TEST(PoseAt, RotatesAlongTheShorterPath) {
  Collider collider = moving();
  collider.motion.keys[1].orientation.coeffs() *= -1;  // the same rotation
  EXPECT_NEAR(angleAt(collider, 0.5), 45, 1e-4);
}

TEST(PoseAt, RepeatsAfterThePeriod) {
  const Collider collider = moving();
  EXPECT_EQ(positionAt(collider, 4), Vec3(0, 0, 0));
  EXPECT_EQ(positionAt(collider, 4 * 1000 + 2.5), Vec3(4, 4, 0));
}

TEST(PoseAt, IsSlowAtKeys) {
  const Collider collider = moving();
  // Smoothstep starts as 3 u^2: after 1 % of the time it has covered 0.03 % of the distance.
  EXPECT_LT(positionAt(collider, 0.01).x(), 4 * 0.00031f);
}

TEST(PoseAt, HasConstantSpeedIfSteady) {
  Collider collider = moving();
  collider.motion.steady = true;
  EXPECT_FLOAT_EQ(positionAt(collider, 0.01).x(), 0.04f);
  EXPECT_EQ(positionAt(collider, 0.25), Vec3(1, 0, 0));
}

TEST(ReachOf, ContainsTheShape) {
  EXPECT_EQ(reachOf(Sphere{0.3f}), 0.3f);
  EXPECT_FLOAT_EQ(reachOf(Capsule{.radius = 0.1f, .length = 0.4f}), 0.3f);
  EXPECT_FLOAT_EQ(reachOf(Box{Vec3(2, 4, 4)}), 3);
  EXPECT_FLOAT_EQ(reachOf(Capsule{.radius = 0.1f, .length = 0.4f, .topRadius = 0.3f}), 0.5f);
  EXPECT_EQ(reachOf(Plane{}), std::numeric_limits<float>::infinity());
}

TEST(SlopeOf, StaysBelowOne) {
  EXPECT_EQ(slopeOf({.radius = 0.1f, .length = 0.4f}), 0);
  EXPECT_FLOAT_EQ(slopeOf({.radius = 0.1f, .length = 0.4f, .topRadius = 0.2f}), 0.25f);
  EXPECT_FLOAT_EQ(slopeOf({.radius = 0.2f, .length = 0.4f, .topRadius = 0.1f}), -0.25f);
  // A change of the radius or of the length may leave one end inside the other.
  EXPECT_EQ(slopeOf({.radius = 0.1f, .length = 0.1f, .topRadius = 0.5f}), kMostSlope);
  EXPECT_EQ(slopeOf({.radius = 0.1f, .length = 0, .topRadius = 0.5f}), 0);
}

TEST(Thinned, LeavesNothingDeeperInside) {
  const Shape shapes[] = {Sphere{0.3f}, Capsule{.radius = 0.3f, .length = 1},
                          Capsule{.radius = 0.1f, .length = 1, .topRadius = 0.4f}, Box{Vec3(1, 2, 3)}};
  for (const Shape& shape : shapes) {
    EXPECT_GT(largestDepth(shape), 0.2f);
    EXPECT_EQ(largestDepth(thinned(shape, 0.2f)), 0.2f);
    EXPECT_EQ(largestDepth(thinned(shape, 9)), largestDepth(shape));
  }
  const Shape limb = thinned(shapes[2], 0.2f);
  EXPECT_EQ(std::get<Capsule>(limb).radius, 0.1f);
  EXPECT_EQ(std::get<Capsule>(limb).topRadius, 0.2f);
}

}  // namespace
}  // namespace clothstream::model
