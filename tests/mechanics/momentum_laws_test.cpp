// SPDX-License-Identifier: MIT
// Momentum and symmetry: forces between nodes of a cloth make neither linear nor angular momentum, and no
// order of work prefers a side. docs/mechanics.md has the figures.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/mechanics/rows.h"
#include "tests/mechanics/ways.h"
#include "tests/simulation/scenes.h"

namespace clothstream::mechanics {
namespace {

using Eigen::Vector3d;
using simulation::NodeState;

// Sums over the nodes that can move, about `about`.
struct Momentum {
  double mass = 0;
  Vector3d moment = Vector3d::Zero();   // of mass
  Vector3d angular = Vector3d::Zero();  // N m s
  double moving = 0;                    // sum of |x| m |v|
  double inertia = 0;                   // about the vertical
};

Momentum momentumOf(const model::Scene& scene, const NodeState& state, const Vector3d& about) {
  const model::Cloth& cloth = scene.cloths[0];
  const std::vector<double> masses = model::nodeMasses(cloth);
  const std::vector<std::uint8_t> pinned = model::pinnedNodes(cloth);
  Momentum sum;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    if (pinned[i] != 0) continue;
    const Vector3d arm = state.positions[i].cast<double>() - about, v = state.velocities[i].cast<double>();
    sum.mass += masses[i];
    sum.moment += masses[i] * arm;
    sum.angular += masses[i] * arm.cross(v);
    sum.moving += masses[i] * arm.norm() * v.norm();
    sum.inertia += masses[i] * (arm.x() * arm.x() + arm.z() * arm.z());
  }
  return sum;
}

// Hung at its first node and released: gravity has no torque about the vertical through that node, so the
// cloth swings, but does not turn.
double spinAfter20Seconds(const Way& way, bool mesh, void (*add)(model::Cloth& cloth) = nullptr) {
  model::Cloth cloth = clothOf(way);
  if (add != nullptr) add(cloth);
  cloth.damping = 1;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = 0}};
  const model::Scene scene = sceneOf(mesh ? model::asMesh(cloth) : cloth);
  tests::Running running(scene);
  const NodeState state = after(running, scene, 20);
  const Momentum momentum = momentumOf(scene, state, state.positions[0].cast<double>());
  return std::abs(momentum.angular.y()) / momentum.inertia;
}

// The same, held by a grab instead.
double spinOfGrabbedCloth(const Way& way) {
  model::Cloth cloth = clothOf(way);
  cloth.damping = 1;
  const model::Scene scene = sceneOf(cloth);
  tests::Running running(scene);
  const model::Pose hand{running.state().positions[0], model::Quaternion::Identity()};
  simulation::TickInputs inputs = tests::inputsOf(scene);
  inputs.grabs = {
      {.state = simulation::Grab::State::takes, .start = hand, .end = hand, .radius = 0.01f, .reach = 0.01f}};
  for (std::uint32_t tick = 0; tick < 20 * scene.simulationRate; ++tick) {
    EXPECT_TRUE(running.tick(inputs).healthy);
    EXPECT_EQ(running.grabs()[0].taken, 1u);
    inputs.grabs[0].state = simulation::Grab::State::holds;
  }
  const NodeState state = running.state();
  const Momentum momentum = momentumOf(scene, state, state.positions[0].cast<double>());
  return std::abs(momentum.angular.y()) / momentum.inertia;
}

// The same without damping, for two seconds of swinging: angular momentum about the vertical, as a share of
// what moves.
double angularMomentumMade(const Way& way) {
  model::Cloth cloth = clothOf(way);
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = 0}};
  const model::Scene scene = sceneOf(cloth);
  tests::Running running(scene);
  const NodeState state = after(running, scene, 2);
  const Momentum momentum = momentumOf(scene, state, state.positions[0].cast<double>());
  return std::abs(momentum.angular.y()) / momentum.moving;
}

// Crumpled by 3 mm, released without gravity: metres that its centre moves in a minute, from those of 10 s.
double driftInAMinute(const Way& way) {
  model::Scene scene = sceneOf(clothOf(way));
  scene.environment.gravity = model::Vec3::Zero();
  std::mt19937 random(5);
  const NodeState start = tests::randomState(scene, random, 0.003f, 0);
  tests::Running running(scene);
  running.restore(start);
  const auto centre = [&](const NodeState& state) {
    const Momentum sum = momentumOf(scene, state, Vector3d::Zero());
    return Vector3d(sum.moment / sum.mass);
  };
  return 6 * (centre(after(running, scene, 10)) - centre(start)).norm();
}

// Hung at both upper corners and released: largest distance of a node from the mirror image of its partner
// after a second.
double asymmetryAfterASecond(const Way& way) {
  model::Cloth cloth = clothOf(way);
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = 7, .columnStep = 7}};
  const model::Scene scene = sceneOf(cloth);
  tests::Running running(scene);
  const NodeState state = after(running, scene, 1);
  double largest = 0;
  for (std::size_t row = 0; row < 8; ++row)
    for (std::size_t column = 0; column < 8; ++column) {
      model::Vec3 mirrored = state.positions[8 * row + 7 - column];
      mirrored.x() = -mirrored.x();
      largest = std::max(largest, double{(state.positions[8 * row + column] - mirrored).norm()});
    }
  return largest;
}

// A feature that acts on the cloth besides its springs.
struct Part {
  std::string name;
  void (*add)(model::Cloth& cloth);
};

// Balls that nearly touch at rest, on cloth that folds easily.
void collideWithItself(model::Cloth& cloth, float friction) {
  cloth.bend.stiffness = 0.1f;
  cloth.selfCollision = model::SelfCollision{.radius = 0.0255f, .friction = friction};
}

std::vector<Part> parts() {
  return {
      {"coarse correction", [](model::Cloth& cloth) { cloth.coarse = model::CoarseCorrection{.cells = 4}; }},
      {"tethers", [](model::Cloth& cloth) { cloth.tethers = model::Tethers{}; }},
      {"self-collision without friction", [](model::Cloth& cloth) { collideWithItself(cloth, 0); }},
      {"self-collision with friction", [](model::Cloth& cloth) { collideWithItself(cloth, 0.5f); }}};
}

class MomentumOfGrabs : public tests::GpuTest {};

class MomentumOfParts : public tests::GpuTest, public testing::WithParamInterface<Part> {};

TEST_P(MomentumOfParts, DoesNotTurnTheCloth) {
  const double spin = spinAfter20Seconds(wayNamed("`xpbd`"), false, GetParam().add);
  EXPECT_LT(spin, 0.001);
  expectRow({GetParam().name, figure(spin)});
}

INSTANTIATE_TEST_SUITE_P(Parts, MomentumOfParts, testing::ValuesIn(parts()),
                         [](const auto& part) { return lettersOf(part.param.name); });

TEST_F(MomentumOfGrabs, DoesNotTurnTheCloth) {
  for (const Way& way : {wayNamed("`massSpring`"), wayNamed("`xpbd`")}) {
    const double spin = spinOfGrabbedCloth(way);
    EXPECT_LT(spin, 0.001);
    expectRow({"a grab instead of the pin, " + way.name, figure(spin)});
  }
}

class MomentumLaws : public tests::GpuTest, public testing::WithParamInterface<Way> {};

TEST_P(MomentumLaws, Hold) {
  const Way& way = GetParam();
  const double grid = spinAfter20Seconds(way, false), mesh = spinAfter20Seconds(way, true);
  const double made = angularMomentumMade(way);
  const double drift = driftInAMinute(way), asymmetry = asymmetryAfterASecond(way);
  EXPECT_LT(grid, 0.001);
  EXPECT_LT(mesh, 0.001);
  EXPECT_LT(made, way.alongLines ? 1e-4 : 0.2);
  EXPECT_LT(drift, 0.001);
  if (way.mirrored) {
    EXPECT_LT(asymmetry, 1e-4);
  }
  expectRow(
      {way.name, figure(grid), figure(mesh), figure(made), figure(1000 * drift), figure(1000 * asymmetry)});
}

INSTANTIATE_TEST_SUITE_P(Solvers, MomentumLaws, testing::ValuesIn(ways()),
                         [](const auto& way) { return lettersOf(way.param.name); });

}  // namespace
}  // namespace clothstream::mechanics
