// SPDX-License-Identifier: MIT
// Dihedral bending: geometry, energy and stability bound.
#include "server/model/hinges.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "server/model/stability.h"
#include "tests/model/meshes.h"

namespace clothstream::model {
namespace {

using Corners = std::array<Eigen::Vector3d, 4>;
using Eigen::Vector3d;

double angleOf(const Corners& at) {
  const Vector3d n1 = (at[0] - at[2]).cross(at[1] - at[2]).normalized();
  const Vector3d n2 = (at[1] - at[3]).cross(at[0] - at[3]).normalized();
  return std::atan2(n2.cross(n1).dot((at[1] - at[0]).normalized()), n1.dot(n2));
}

// Small and large angles to both sides.
TEST(Hinges, HaveTheRightAngleAndGradient) {
  for (const double lift : {-3.0, -0.4, 0.0, 0.01, 0.7, 5.0}) {
    SCOPED_TRACE(lift);
    const Corners at = {Vector3d(0.1, 0, 0.2), Vector3d(0, 1, 0), Vector3d(-1, 0.3, lift),
                        Vector3d(0.8, 0.6, 0.1)};
    const HingeShape shape = hingeShape(at, 0);
    EXPECT_NEAR(bentFromRest(shape, 0), 2 * std::sin(angleOf(at) / 2), 1e-12);
    Vector3d sum = Vector3d::Zero(), moment = Vector3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      sum += shape.gradients[i];
      moment += at[i].cross(shape.gradients[i]);
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double kStep = 1e-6;
        Corners above = at, below = at;
        above[i][axis] += kStep;
        below[i][axis] -= kStep;
        EXPECT_NEAR(shape.gradients[i][axis], (angleOf(above) - angleOf(below)) / (2 * kStep), 1e-8);
      }
    }
    // Rigid motion of all four nodes does not change the angle.
    EXPECT_LT(sum.norm(), 1e-12);
    EXPECT_LT(moment.norm(), 1e-12);
  }
}

// Two triangles of 1 m at an edge along X, opened by `angle` from lying flat.
Corners openedBy(double angle) {
  return {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0.5, 1, 0),
          Vector3d(0.5, -std::cos(angle), std::sin(angle))};
}

// The force on the angle is -2 sin(delta / 2), whatever the rest angle is, also where the faces pass through
// each other at 180 degrees. There is one place with a jump: opposite to the rest angle.
TEST(Hinges, PullTowardsTheirRestAngleOnTheShorterWay) {
  const double pi = std::acos(-1.0);
  for (const double rest : {0.0, 1.0, -2.5, 3.0, 3.14159, -3.1415}) {
    for (int step = -31; step <= 31; ++step) {
      const double delta = 0.1 * step;
      SCOPED_TRACE(testing::Message() << "rest " << rest << ", from rest by " << delta);
      const Corners at = openedBy(rest + delta);
      EXPECT_NEAR(std::remainder(angleOf(at) - rest - delta, 2 * pi), 0, 1e-12);
      EXPECT_NEAR(bentFromRest(hingeShape(at, 0), rest), 2 * std::sin(delta / 2), 1e-12);
    }
  }
}

TEST(Hinges, IncludeDiagonalsAndInnerEdgesOfQuads) {
  Cloth cloth;
  cloth.grid = {.rows = 4, .columns = 6, .width = 0.5f, .height = 0.3f};
  EXPECT_EQ(hinges(cloth).size(), 2u * (3 * 5 + 3 * 4 + 2 * 5));
  for (const Hinge& hinge : hinges(cloth)) EXPECT_EQ(hinge.restAngle, 0);
  EXPECT_EQ(hinges(asMesh(cloth)).size(), hinges(cloth).size());
}

// Plate energy B / 2 curvature^2 area, to second order in the angle between faces.
double plateEnergy(const std::vector<Hinge>& hinges, const std::vector<Vector3d>& bent) {
  double sum = 0;
  for (const Hinge& hinge : hinges) {
    Corners at;
    for (std::size_t i = 0; i < 4; ++i) at[i] = bent[hinge.nodes[i]];
    const double now = bentFromRest(hingeShape(at, 0), 0);
    sum += 0.5 * hinge.weight * now * now;
  }
  return sum;
}

// Bends the cloth onto a cylinder whose axis has an angle of `degrees` to Y.
std::vector<Vector3d> rolled(const std::vector<Vec3>& flat, double curvature, double degrees) {
  const double angle = degrees * std::acos(-1.0) / 180;
  const Vector3d across(std::cos(angle), std::sin(angle), 0);
  std::vector<Vector3d> bent;
  for (const Vec3& node : flat) {
    const Vector3d p = node.cast<double>();
    const double s = across.dot(p);
    bent.push_back(p + (std::sin(curvature * s) / curvature - s) * across +
                   Vector3d(0, 0, (1 - std::cos(curvature * s)) / curvature));
  }
  return bent;
}

// Energy per area from cloths with 10, 20 and 30 times as many cells per side. The fringe has fewer hinges,
// so the growth of the energy is compared. It is quadratic in n: n^2 inside, n at the edges, 1 at the
// corners.
template <typename Patch>
double energyOfACell(const Patch& patch, double curvature, double degrees) {
  const auto energy = [&](std::uint32_t n) {
    const Cloth cloth = patch(n);
    return plateEnergy(hinges(cloth), rolled(restPositions(cloth), curvature, degrees));
  };
  return (energy(30) - 2 * energy(20) + energy(10)) / 200;
}

// At an angle phi to the rows, with p = cos^2, q = sin cos and r = sin^2, the ratio to the plate energy is
// p^2 + r^2 + (2 + 4/8) q^2 = 1 + sin(2 phi)^2 / 8.
TEST(Hinges, MatchPlateEnergyOnGrids) {
  const auto patch = [](std::uint32_t n) {
    Cloth cloth;
    const float side = 0.01f * static_cast<float>(n);
    cloth.grid = {.rows = n + 1, .columns = n + 1, .width = side, .height = side};
    return cloth;
  };
  constexpr double kCurvature = 2;
  for (const double degrees : {0.0, 20.0, 45.0, 90.0, 135.0}) {
    const double twice = std::sin(2 * degrees * std::acos(-1.0) / 180);
    const double energy = energyOfACell(patch, kCurvature, degrees);
    EXPECT_NEAR(energy / (0.5 * kCurvature * kCurvature * 1e-4), 1 + twice * twice / 8, 0.01)
        << degrees << " degrees";
  }
}

TEST(Hinges, MatchPlateEnergyInEveryDirectionOnEquilateralTriangles) {
  const auto patch = [](std::uint32_t n) {
    const auto side = static_cast<float>(n);
    MeshShape shape;
    for (std::uint32_t row = 0; row <= n; ++row)
      for (std::uint32_t column = 0; column <= n; ++column)
        shape.positions.emplace_back(
            0.01f * (static_cast<float>(column) + 0.5f * static_cast<float>(row) - 0.75f * side),
            0.01f * std::sqrt(0.75f) * (static_cast<float>(row) - 0.5f * side), 0.0f);
    for (std::uint32_t row = 0; row < n; ++row)
      for (std::uint32_t column = 0; column < n; ++column) {
        const std::uint32_t a = row * (n + 1) + column, b = a + 1, c = a + n + 1, d = c + 1;
        shape.triangles.push_back({a, b, c});
        shape.triangles.push_back({b, d, c});
      }
    shape.submeshes = {{"", 0, static_cast<std::uint32_t>(shape.triangles.size())}};
    Cloth cloth;
    cloth.mesh = std::make_shared<const Mesh>(makeMesh(shape));
    return cloth;
  };
  constexpr double kCurvature = 2;
  const double area = std::sqrt(0.75) * 1e-4;  // of two triangles
  for (const double degrees : {0.0, 20.0, 30.0, 75.0, 90.0})
    EXPECT_NEAR(energyOfACell(patch, kCurvature, degrees) / (0.5 * kCurvature * kCurvature * area), 1, 0.01)
        << degrees << " degrees";
}

// Squares whose corners alternate up and down: only the diagonals bend.
TEST(Hinges, ResistAlternatingTwists) {
  Cloth cloth;
  cloth.grid = {.rows = 5, .columns = 5, .width = 0.04f, .height = 0.04f};
  std::vector<Vector3d> bent;
  for (const Vec3& node : restPositions(cloth)) bent.push_back(node.cast<double>());
  for (std::size_t i = 0; i < bent.size(); ++i) bent[i].z() = i % 2 == 0 ? 1e-4 : -1e-4;
  // The faces at a diagonal rotate by twice 2e-4 over half of its length, on both diagonals of 16 squares.
  // Their total weight is 1/8 of 2.
  const double turn = 2 * 2e-4 / (0.01 / std::sqrt(2.0));
  EXPECT_NEAR(plateEnergy(hinges(cloth), bent), 16 * 0.5 * 0.25 * turn * turn,
              1e-3 * 16 * 0.5 * 0.25 * turn * turn);
}

// Bound of a square with one free corner, computed by hand from the diagonal opposite the corner and the one
// through it.
TEST(Hinges, BoundTheTimeStep) {
  Scene scene;
  Cloth cloth;
  cloth.grid = {.rows = 2, .columns = 2, .width = 0.1f, .height = 0.1f};
  cloth.mass = 0.04f;
  cloth.pinnedVertices = {0, 1, 2};
  cloth.dihedralBending = 0.6f;
  scene.cloths = {cloth};
  scene.environment.airDensity = 0;
  scene.simulationRate = 10;
  // Each weighs a sixteenth of 0.1^2 2 / 0.1^2. Opposite corners have heights of 0.1 / sqrt(2) above it, and
  // each end has half of both.
  const double gradient = std::sqrt(2.0) / 0.1;
  const double rate = 2 * (2.0 / 16) * gradient * 4 * gradient / 0.01;
  EXPECT_NEAR(bendingRate(cloth), rate, 1e-5 * rate);
  const auto substeps = static_cast<std::uint32_t>(std::ceil(0.1 * std::sqrt(0.6 * rate / 4)));
  EXPECT_EQ(stableSubsteps(scene), substeps);
}

}  // namespace
}  // namespace clothstream::model
