// SPDX-License-Identifier: MIT
// Normals of shapes whose normals are known.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/reference/cloths.h"

namespace clothstream::reference {
namespace {

TEST(ReferenceNormals, PointAlongZForASheetAtRest) {
  for (const Vec3& normal : ReferenceCloth(sheet(4, 5)).normals())
    EXPECT_LT((normal - Vec3::UnitZ()).norm(), 1e-12);
}

TEST(ReferenceNormals, TurnWithThePose) {
  model::Cloth cloth = sheet(4, 5);
  cloth.grid.pose.orientation = model::Quaternion(std::sqrt(0.5f), -std::sqrt(0.5f), 0, 0);
  // Quarter turn about -X: +Z becomes +Y. Positions are floats.
  for (const Vec3& normal : ReferenceCloth(cloth).normals()) EXPECT_LT((normal - Vec3::UnitY()).norm(), 1e-5);
}

TEST(ReferenceNormals, FollowTheGradientOfABowl) {
  ReferenceCloth cloth(sheet(21, 21));
  for (Vec3& x : cloth.positions()) x.z() = 0.1 * (x.x() * x.x() + x.y() * x.y());
  const std::vector<Vec3> normals = cloth.normals();
  for (std::size_t row = 1; row < 20; ++row)
    for (std::size_t column = 1; column < 20; ++column) {
      const Vec3& x = cloth.positions()[row * 21 + column];
      const Vec3 expected = Vec3(-0.2 * x.x(), -0.2 * x.y(), 1).normalized();
      // Inside, the four quadrants make central differences, which are exact for a paraboloid but for their
      // products: spacing^2 times curvature^2.
      EXPECT_LT((normals[row * 21 + column] - expected).norm(), 0.1 * 0.1 * 0.2 * 0.2);
    }
}

TEST(ReferenceNormals, PointAlongZForASheetWithoutArea) {
  ReferenceCloth cloth(sheet(3, 3));
  for (Vec3& x : cloth.positions()) x = Vec3(1, 2, 3);
  for (const Vec3& normal : cloth.normals()) EXPECT_EQ(normal, Vec3::UnitZ());
}

}  // namespace
}  // namespace clothstream::reference
