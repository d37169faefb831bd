// SPDX-License-Identifier: MIT
// Volume of closed meshes and its gradient, the law of the gas, and meshes that cannot hold any.
#include "server/model/gas.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/model/meshes.h"

namespace clothstream::model {
namespace {

using testing::HasSubstr;

std::vector<Eigen::Vector3d> places(const MeshShape& shape) {
  std::vector<Eigen::Vector3d> places;
  for (const Vec3& position : shape.positions) places.push_back(position.cast<double>());
  return places;
}

Cloth clothOf(MeshShape shape) {
  Cloth cloth;
  cloth.mesh = std::make_shared<const Mesh>(makeMesh(std::move(shape)));
  cloth.mass = 1;
  return cloth;
}

std::string unfit(MeshShape shape) {
  return unfitForGas(clothOf(std::move(shape))).value_or("");
}

// All numbers are multiples of 1/16, so that nothing is rounded but the sixths.
TEST(Gas, CubeHasItsVolumeWhereverItIs) {
  for (const Vec3& centre : {Vec3(0, 0, 0), Vec3(1, -2, 3), Vec3(4096, 512, -2048)}) {
    const MeshShape shape = cube(0.5f, centre);
    EXPECT_EQ(enclosedVolume(shape.triangles, places(shape)), 0.125);
    EXPECT_EQ(clothOf(shape).mesh->volume, 0.125);
  }
}

// The volume is linear in the place of each single node, so that a difference is the gradient.
TEST(Gas, GradientIsTheChangeOfTheVolume) {
  const MeshShape shape = cube(0.5f, {1, -2, 3});
  std::vector<Eigen::Vector3d> at = places(shape);
  const std::vector<Eigen::Vector3d> gradients = volumeGradients(shape.triangles, at);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t node = 0; node < at.size(); ++node) {
    sum += gradients[node];
    for (int axis = 0; axis < 3; ++axis) {
      at[node][axis] += 0.25;
      const double after = enclosedVolume(shape.triangles, at);
      at[node][axis] -= 0.25;
      EXPECT_NEAR((after - 0.125) / 0.25, gradients[node][axis], 1e-15);
    }
  }
  EXPECT_LT(sum.norm(), 1e-15);
  // The corner that the diagonals of its three faces leave has a third of half of each face; the one that
  // they meet has all three whole.
  EXPECT_NEAR(gradients[0].norm(), std::sqrt(3.0) * 0.25 / 3, 1e-15);
}

TEST(Gas, SphereHasItsVolumeAndArea) {
  const MeshShape shape = icosphere(8, 0.3f);
  EXPECT_EQ(shape.positions.size(), 642u);
  const Cloth cloth = clothOf(shape);
  // The middles of the flat triangles are inside the sphere, by up to an eighth of the square of an edge.
  EXPECT_NEAR(cloth.mesh->volume, 4.0 / 3 * 3.14159265 * 0.027, 0.015 * 0.1131);
  EXPECT_LT(cloth.mesh->volume, 4.0 / 3 * 3.14159265 * 0.027);
  EXPECT_FALSE(cloth.mesh->openEdge);
  EXPECT_EQ(cloth.mesh->pieces, 1u);
  double most = 0, least = 1;
  for (const Eigen::Vector3d& gradient : volumeGradients(shape.triangles, places(shape))) {
    most = std::max(most, gradient.norm());
    least = std::min(least, gradient.norm());
  }
  EXPECT_LT(most, 4 * least);
}

TEST(Gas, PressureFulfilsItsLaw) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> atRest(-0.49, 9.9), volume(-2, 12), exponent(-8, 6);
  for (int i = 0; i < 10'000; ++i) {
    const double rest = atRest(random), without = volume(random), response = std::pow(10, exponent(random));
    const double pressure = gasPressure(rest, without, response);
    EXPECT_GT(pressure, -1);
    // The terms cancel down to 1 + atRest from these sizes, in double precision.
    const double size = (1 + std::abs(pressure)) * (std::abs(without) + response * std::abs(pressure));
    EXPECT_NEAR((1 + pressure) * (without + response * pressure), 1 + rest, 1e-14 * (1 + size) + 1e-12)
        << rest << " " << without << " " << response;
  }
  EXPECT_EQ(gasPressure(0.25, 1, 3), 0.25 * 2 / (1 + 3 + std::sqrt(4 + 12 * 1.25)) * 1);
}

TEST(Gas, VolumeChangesByAQuarterAtMost) {
  // 1 + 0.1 * 2 is within the bound, 1 + 10 * 2 is not.
  EXPECT_EQ(boundedPressure(2, 1, 1, 0.1), 2);
  EXPECT_EQ(boundedPressure(2, 1, 1, 10), 0.025);
  EXPECT_EQ(boundedPressure(-0.5, 1, 1, 10), -0.025);
  // It grows by itself; the gas brakes it.
  EXPECT_EQ(boundedPressure(0, 1, 3, 2), -0.875);
  // Flat cloth is filled again.
  EXPECT_DOUBLE_EQ(boundedPressure(2, 0, 0, 1), 0.025);
  EXPECT_EQ(boundedPressure(2, 1, 1, 0), 2);
}

TEST(Gas, IsRefusedWhereNothingHoldsIt) {
  EXPECT_EQ(unfit(cube(0.5f)), "");
  EXPECT_THAT(unfitForGas(grid(3, 3)).value_or(""), HasSubstr("is a grid"));

  MeshShape open = cube(0.5f);
  open.triangles.pop_back();
  open.submeshes = {{"", 0, 11}};
  EXPECT_THAT(unfit(open), HasSubstr("is open, among others at the edge from (-0.25 -0.25 0.25) to "
                                     "(-0.25 0.25 0.25) m"));

  MeshShape turned = cube(0.5f);
  for (Triangle& triangle : turned.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_THAT(unfit(turned), HasSubstr("is inside out"));

  MeshShape two = cube(0.5f);
  const MeshShape other = cube(0.5f, {1, 0, 0});
  two.positions.insert(two.positions.end(), other.positions.begin(), other.positions.end());
  for (Triangle triangle : other.triangles) {
    for (std::uint32_t& node : triangle) node += 8;
    two.triangles.push_back(triangle);
  }
  two.submeshes = {{"", 0, 24}};
  EXPECT_THAT(unfit(two), HasSubstr("has 2 separate pieces"));

  EXPECT_EQ(unfit(cube(0.0101f)), "");
  EXPECT_THAT(unfit(cube(0.0099f)), HasSubstr("encloses 9.7e-07 m^3 at rest; gas needs at least 1e-06 m^3"));
}

}  // namespace
}  // namespace clothstream::model
