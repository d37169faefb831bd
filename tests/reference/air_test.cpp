// SPDX-License-Identifier: MIT
// Drag and lift of the air on flat sheets, where the whole force has a closed form.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/reference/cloths.h"

namespace clothstream::reference {
namespace {

// 0.6 m x 0.4 m, in the XY plane.
model::Cloth sail(float drag, float lift) {
  model::Cloth cloth = sheet(5, 7);
  cloth.drag = drag;
  cloth.lift = lift;
  return cloth;
}
constexpr double kArea = 0.24;

Vec3 totalAirForce(const ReferenceCloth& cloth, const model::Vec3& wind) {
  std::vector<Vec3> forces(cloth.nodeCount(), Vec3::Zero());
  cloth.accumulateAirForces({.wind = wind, .airDensity = 1.2f}, forces);
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : forces) sum += force;
  return sum;
}

// Rest positions and the wind are floats.
constexpr double kTolerance = 1e-5;

TEST(ReferenceAir, DragsAFlatSheetByHalfDensityAreaAndSpeedSquared) {
  const Vec3 force = totalAirForce(ReferenceCloth(sail(0.8f, 0)), model::Vec3(0, 0, 5));
  EXPECT_LT((force - Vec3(0, 0, 0.5 * 1.2 * 0.8 * kArea * 25)).norm(), kTolerance);
}

TEST(ReferenceAir, DragsFromEitherSide) {
  const Vec3 force = totalAirForce(ReferenceCloth(sail(0.8f, 0)), model::Vec3(0, 0, -5));
  EXPECT_LT((force - Vec3(0, 0, -0.5 * 1.2 * 0.8 * kArea * 25)).norm(), kTolerance);
}

TEST(ReferenceAir, IgnoresASheetThatIsEdgeOnOrMovesWithTheWind) {
  EXPECT_LT(totalAirForce(ReferenceCloth(sail(1, 1)), model::Vec3(5, 3, 0)).norm(), kTolerance);
  ReferenceCloth drifting(sail(1, 1));
  for (Vec3& velocity : drifting.velocities()) velocity = Vec3(1, 2, 3);
  EXPECT_LT(totalAirForce(drifting, model::Vec3(1, 2, 3)).norm(), kTolerance);
}

TEST(ReferenceAir, LiftsAcrossTheWindByCosineAndSineOfItsAngle) {
  const double angle = std::numbers::pi / 6;
  const model::Vec3 wind(static_cast<float>(5 * std::sin(angle)), 0, static_cast<float>(5 * std::cos(angle)));
  const Vec3 force = totalAirForce(ReferenceCloth(sail(0, 0.9f)), wind);
  EXPECT_NEAR(force.dot(wind.cast<double>()), 0, kTolerance);
  EXPECT_NEAR(force.norm(), 0.5 * 1.2 * 0.9 * kArea * 25 * std::cos(angle) * std::sin(angle), kTolerance);
  EXPECT_GT(force.z(), 0);
}

TEST(ReferenceAir, IsOffWithoutDensity) {
  std::vector<Vec3> forces(35, Vec3::Zero());
  ReferenceCloth(sail(1, 1)).accumulateAirForces({.wind = model::Vec3(0, 0, 9), .airDensity = 0}, forces);
  for (const Vec3& force : forces) EXPECT_EQ(force, Vec3::Zero());
}

}  // namespace
}  // namespace clothstream::reference
