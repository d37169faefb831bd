// SPDX-License-Identifier: MIT
// Dihedral bending on the device: against the reference, a cantilever, and changes while it runs.
#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "server/model/hinges.h"
#include "server/model/stability.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::SolverKind;
using simulation::NodeState;

class DihedralBending : public GpuTest {};

// Bent at rest, without springs: only gravity and hinges move it.
model::Cloth bowl(float rigidity) {
  model::MeshShape shape = model::disc(6, 0.12f);
  for (model::Vec3& node : shape.positions) node.y() = 2 * (node.x() * node.x() + node.z() * node.z());
  model::Cloth cloth;
  cloth.name = "bowl";
  cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(shape));
  cloth.mass = 0.01f;
  cloth.dihedralBending = rigidity;
  cloth.pinnedVertices = {3, 7};
  return cloth;
}

model::Cloth looseGrid(float rigidity) {
  model::Cloth cloth = calmCloth(13, 9);
  cloth.name = "grid";
  cloth.structural = cloth.shear = cloth.bend = {};
  cloth.dihedralBending = rigidity;
  cloth.pins = {topRow(cloth)};
  return cloth;
}

// Largest difference of a step's velocities from the reference. The rounding of a node's position rotates a
// hinge by the rounding over the least height. Unit normals and values computed from them have the error of
// five reciprocal roots, 7e-7 each. The forces of hinges then have that share of the largest possible force
// as their error. The sum is rounded to velocities of up to 1 m/s.
double errorOf(const model::Cloth& cloth, const NodeState& state, std::uint32_t first, double h) {
  const std::vector<double> masses = model::nodeMasses(cloth);
  std::vector<double> errors(cloth.nodeCount(), 0);
  for (const model::Hinge& hinge : model::hinges(cloth)) {
    std::array<Eigen::Vector3d, 4> at;
    for (std::size_t i = 0; i < 4; ++i) at[i] = state.positions[first + hinge.nodes[i]].cast<double>();
    const model::HingeShape shape = model::hingeShape(at, hinge.leastSquare);
    double steepest = 0;
    for (const Eigen::Vector3d& gradient : shape.gradients) steepest = std::max(steepest, gradient.norm());
    const double bent = std::abs(model::bentFromRest(shape, double{hinge.restAngle}));
    const double placed = 4 * steepest * 0.5 * kRounding + 5 * 7e-7 * (1 + bent);
    const double pull = bent + 2;
    for (std::size_t i = 0; i < 4; ++i)
      errors[hinge.nodes[i]] += double{cloth.dihedralBending} * hinge.weight * steepest * placed * pull;
  }
  double most = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) most = std::max(most, h * errors[i] / masses[i]);
  return most + 4 * kRounding;
}

TEST_F(DihedralBending, MovesGridsAndMeshesAsTheReference) {
  model::Scene scene = sceneOf({looseGrid(2e-4f), bowl(1e-5f)});
  scene.substeps = 1;
  scene.simulationRate = scene.streamRate = 720;
  ASSERT_EQ(model::stableSubsteps(scene), 1u);
  std::mt19937 random(3);
  const NodeState start = randomState(scene, random, 0.005f, 0.3f);
  Running running(scene);
  running.restore(start);
  ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputsOf(scene)));
  const double h = scene.substepSeconds();
  const double error = std::max(errorOf(scene.cloths[0], start, 0, h),
                                errorOf(scene.cloths[1], start, scene.cloths[0].nodeCount(), h));
  EXPECT_LT(largestSpeedDifference(running.state(), reference), error);
  EXPECT_LT(largestDistance(running.state(), reference), h * error + kRounding);

  // Without hinges the nodes would be elsewhere, so the comparison can fail.
  model::Scene limp = scene;
  for (model::Cloth& cloth : limp.cloths) cloth.dihedralBending = 0;
  reference::ReferenceSimulation other(limp);
  setState(other, start);
  other.tick(referenceInputs(inputsOf(limp)));
  EXPECT_GT(largestSpeedDifference(running.state(), other), 20 * error);
}

// A strip held by its first two columns bends under its weight by what the moments at its hinges say. Turned
// by at most delta / L = 5 %, it errs from this linear theory by about the square of that.
TEST_F(DihedralBending, BendsACantileverAsBeamsBend) {
  constexpr std::uint32_t kColumns = 21, kRows = 3;
  model::Cloth strip = calmCloth(kRows, kColumns);
  strip.grid.width = 0.2f;
  strip.grid.height = 0.02f;
  strip.grid.pose.orientation = turned(-90, model::Vec3::UnitX());
  strip.mass = 0.0008f;
  strip.structural = {200, 0};
  strip.shear = {100, 0};
  strip.bend = {};
  strip.damping = 40;
  strip.dihedralBending = 0.04f;
  strip.pins = {{.firstRow = 0, .lastRow = kRows - 1, .firstColumn = 0, .lastColumn = 1}};
  model::Scene scene = sceneOf({strip});
  scene.simulationRate = scene.streamRate = 360;
  scene.substeps = model::stableSubsteps(scene);
  ASSERT_GT(scene.substeps, 0u);
  Running running(scene);
  for (int tick = 0; tick < 180; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);

  const double spacing = 0.2 / (kColumns - 1), weight = 9.81 * strip.mass / kColumns;
  double expected = 0;
  for (std::uint32_t hinge = 1; hinge + 1 < kColumns; ++hinge) {
    double moment = 0;
    for (std::uint32_t column = hinge + 1; column < kColumns; ++column)
      moment += weight * spacing * (column - hinge);
    const double turn = moment * spacing / (double{strip.dihedralBending} * strip.grid.height);
    expected += turn * spacing * (kColumns - 1 - hinge);
  }
  const NodeState state = running.state();
  const float tip = state.positions[kColumns + kColumns - 1].y();
  EXPECT_GT(expected, 0.005);
  EXPECT_NEAR(-tip, expected, 0.02 * expected);
}

// The rigidity is at its bound. The energy does not grow.
TEST_F(DihedralBending, IsStableAtItsBound) {
  model::Cloth sheet = looseGrid(0.05f);
  sheet.damping = 0;
  model::Scene scene = sceneOf({sheet});
  scene.substeps = model::stableSubsteps(scene);
  ASSERT_GT(scene.substeps, 1u);
  scene.environment.gravity = model::Vec3::Zero();
  std::mt19937 random(5);
  const NodeState start = randomState(scene, random, 1e-4f, 0);
  Running running(scene);
  running.restore(start);
  reference::ReferenceCloth energies(sheet);
  const auto energy = [&](const NodeState& state) {
    for (std::size_t i = 0; i < state.positions.size(); ++i) {
      energies.positions()[i] = state.positions[i].cast<double>();
      energies.velocities()[i] = state.velocities[i].cast<double>();
    }
    return energies.bendingEnergy() + energies.kineticEnergy();
  };
  const double before = energy(start);
  for (int tick = 0; tick < 100; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
  // Semi-implicit Euler keeps an energy that differs from this one by less than its half at s < 1, and by
  // what s leaves of 4 beyond; ten times says that nothing has blown up.
  EXPECT_LT(energy(running.state()), 10 * before);
}

// Dihedral bending is switched on in motion, with every solver. The state keeps every bit, and the motion is
// that of a scene that always had it.
TEST_F(DihedralBending, StartsAndStopsWhileItRuns) {
  for (const SolverKind kind : {SolverKind::massSpring, SolverKind::constraint, SolverKind::acad,
                                SolverKind::xpbd, SolverKind::implicitEuler}) {
    SCOPED_TRACE(static_cast<int>(kind));
    model::Cloth sheet = calmCloth(9, 8), disc = discCloth(4);
    sheet.pins = {topRow(sheet)};
    disc.name = "disc";
    sheet.solver.kind = disc.solver.kind = kind;
    model::Scene scene = sceneOf({sheet, disc});
    Running changing(scene);
    for (const float rigidity : {0.0f, 1e-4f, 3e-4f, 0.0f}) {
      scene.cloths[1].dihedralBending = rigidity;
      scene.cloths[0].dihedralBending = rigidity == 3e-4f ? 1e-4f : 0;
      SCOPED_TRACE(rigidity);
      expectGoesOnAsAlways(changing, scene, inputsOf(scene), 3);
    }
  }
}

}  // namespace
}  // namespace clothstream::tests
