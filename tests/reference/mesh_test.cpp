// SPDX-License-Identifier: MIT
// Meshes in the reference: the forces of a grid that is given as a mesh, and normals.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/model/meshes.h"
#include "tests/reference/cloths.h"

namespace clothstream::reference {
namespace {

// A mesh's rest lengths come from float positions, a grid's from its spacing. For coordinates up to |p| they
// differ by the rounding of two positions and of the length, at most 4 |p| 2^-24. The forces differ by the
// stiffness times that for each of a node's twelve springs.
TEST(ReferenceMesh, PullsAsTheEquivalentGrid) {
  const model::Cloth model = sheetWithAllSprings(7, 6);
  ReferenceCloth grid(model), mesh(model::asMesh(model));
  shake(grid, 0.02, 0.5);
  shake(mesh, 0.02, 0.5);
  std::vector<Vec3> expected(grid.nodeCount(), Vec3::Zero()), found = expected;
  grid.accumulateSpringForces(expected);
  mesh.accumulateSpringForces(found);
  const double lengthError = 4 * 0.7 * std::ldexp(1.0, -24);
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_LE((found[i] - expected[i]).norm(), 4 * (100 + 60 + 30) * lengthError * 1.1) << i;
}

TEST(ReferenceMesh, FeelsTheAirAsTheEquivalentGrid) {
  model::Cloth model = sheetWithAllSprings(5, 6);
  model.drag = 1;
  model.lift = 0.5f;
  ReferenceCloth grid(model), mesh(model::asMesh(model));
  shake(grid, 0.02, 0.5);
  shake(mesh, 0.02, 0.5);
  const model::Environment windy{
      .gravity = model::Vec3::Zero(), .wind = model::Vec3(1, 2, 3), .airDensity = 1.2f};
  std::vector<Vec3> expected(grid.nodeCount(), Vec3::Zero()), found = expected;
  grid.accumulateAirForces(windy, expected);
  mesh.accumulateAirForces(windy, found);
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(found[i], expected[i]) << i;
}

TEST(ReferenceMesh, HasTheNormalsOfItsTriangles) {
  model::Cloth model;
  model.mass = 1;
  model::MeshShape dome = model::disc(12, 0.5f);
  for (model::Vec3& p : dome.positions) p.y() = std::sqrt(1 - p.x() * p.x() - p.z() * p.z());
  model.mesh = std::make_shared<const model::Mesh>(model::makeMesh(dome));
  const ReferenceCloth cloth(model);
  const std::vector<Vec3> normals = cloth.normals();
  // On a unit sphere the normal of a node equals its position. The mean over the triangles is off by a degree
  // if they lie on one side of the node.
  for (std::size_t i = 0; i < normals.size(); ++i)
    EXPECT_GT(normals[i].dot(cloth.positions()[i]), std::cos(0.05)) << i;
  EXPECT_NEAR(normals[0].y(), 1, 1e-6);
}

}  // namespace
}  // namespace clothstream::reference
