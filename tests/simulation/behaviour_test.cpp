// SPDX-License-Identifier: MIT
// Physics of whole runs: falling, momentum, pins, spheres, and a comparison with the reference over 200
// ticks.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;
using simulation::TickInputs;

class Behaviour : public GpuTest {};

// Semi-implicit Euler falls g h^2 n (n + 1) / 2 in n steps. The sum of n rounded steps errs by at most half
// an ulp of the distance each, and the cloth stays as it is: forces of a cloth at rest are of rounding.
TEST_F(Behaviour, AFreeClothFallsAsTheFormulaSays) {
  model::Cloth cloth = calmCloth(12, 15);
  cloth.damping = 0;
  const model::Scene scene = sceneOf({cloth});
  Running running(scene);
  const std::vector<model::Vec3> start = running.state().positions;
  for (int tick = 0; tick < 72; ++tick) running.tick(inputsOf(scene));
  const double n = 720, h = scene.substepSeconds();
  const double fall = 9.81 * h * h * n * (n + 1) / 2;
  const std::vector<model::Vec3> end = running.state().positions;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const reference::Vec3 moved = end[i].cast<double>() - start[i].cast<double>();
    EXPECT_NEAR(-moved.y(), fall, 1e-5 * fall);
    EXPECT_LT(std::hypot(moved.x(), moved.z()), 1e-6);
  }
}

TEST_F(Behaviour, ExplicitEulerFallsOneStepBehind) {
  model::Cloth cloth = calmCloth(4, 4);
  cloth.damping = 0;
  model::Scene scene = sceneOf({cloth});
  scene.integrator = model::Integrator::explicitEuler;
  Running running(scene);
  const model::Vec3 start = running.state().positions[5];
  for (int tick = 0; tick < 36; ++tick) running.tick(inputsOf(scene));
  const double n = 360, h = scene.substepSeconds();
  const double fall = 9.81 * h * h * n * (n - 1) / 2;
  EXPECT_NEAR(start.y() - running.state().positions[5].y(), fall, 1e-5 * fall);
}

// Springs pull both ends alike to the bit; only the rounding of each node's own sums is left. Over a second
// the sum of 2,000 nodes' momenta, each rounded some tens of times a substep, stays within a millionth of
// what flows about.
TEST_F(Behaviour, AFreeClothKeepsItsMomentum) {
  model::Cloth cloth = calmCloth(40, 50);
  cloth.damping = 0;
  model::Scene scene = sceneOf({cloth});
  scene.environment.gravity = model::Vec3::Zero();
  std::mt19937 random(11);
  const NodeState start = randomState(scene, random, 0.004f, 0.5f);
  Running running(scene);
  running.restore(start);
  for (int tick = 0; tick < 72; ++tick) running.tick(inputsOf(scene));
  const NodeState end = running.state();
  reference::Vec3 linear = reference::Vec3::Zero(), angular = reference::Vec3::Zero();
  double flowing = 0, turning = 0;
  for (std::size_t i = 0; i < start.positions.size(); ++i) {
    const auto at = [&](const NodeState& s) {
      return std::pair(reference::Vec3(s.positions[i].cast<double>()),
                       reference::Vec3(s.velocities[i].cast<double>()));
    };
    const auto [x0, v0] = at(start);
    const auto [x1, v1] = at(end);
    linear += v1 - v0;
    angular += x1.cross(v1) - x0.cross(v0);
    flowing += v0.norm();
    turning += x0.norm() * v0.norm();
  }
  EXPECT_LT(linear.norm(), 1e-6 * flowing);
  EXPECT_LT(angular.norm(), 1e-5 * turning);
}

TEST_F(Behaviour, PinnedNodesKeepEveryBit) {
  model::Cloth cloth = calmCloth(20, 20);
  cloth.grid.pose.position = model::Vec3(0.123f, 1.7f, -0.3f);
  cloth.pins = {
      topRow(cloth),
      {.firstRow = 7, .lastRow = 19, .rowStep = 4, .firstColumn = 1, .lastColumn = 18, .columnStep = 5}};
  cloth.drag = 1;
  model::Scene scene = sceneOf({cloth});
  scene.environment.wind = model::Vec3(2, 1, 5);
  Running running(scene);
  const NodeState start = running.state();
  // The sphere goes through pinned nodes too.
  for (int tick = 0; tick < 50; ++tick)
    running.tick(inputsOf(
        scene,
        {{model::Sphere{0.2f}, {model::Vec3(0.1f, 1.7f, -0.3f)}, {model::Vec3(0.1f, 1.6f, -0.3f)}, 1}}));
  const NodeState end = running.state();
  const std::vector<std::uint8_t> pinned = model::pinnedNodes(cloth);
  int moved = 0;
  for (std::size_t i = 0; i < pinned.size(); ++i) {
    if (pinned[i] != 0) {
      EXPECT_EQ(end.positions[i], start.positions[i]) << i;
      EXPECT_EQ(end.velocities[i], model::Vec3::Zero()) << i;
    } else {
      moved += end.positions[i] != start.positions[i] ? 1 : 0;
    }
  }
  EXPECT_GT(moved, 300);
}

// Simulates 2,000 substeps of a cloth that sags, overdamped, and moves a little in the wind. The motion
// amplifies no difference. Each substep rounds every position to half an ulp of the extent (0.5 m), and the
// spring forces of that position with it. That moves the velocity by h k / m of the rounding over a period of
// the springs, sqrt(m / k), some tenfold. These independent errors add up as a random walk; the test allows
// three standard deviations. The error of the float time step, 2^-25, is far smaller.
TEST_F(Behaviour, ACalmClothStaysWithTheReferenceFor200Ticks) {
  model::Cloth cloth = calmCloth(24, 24);
  cloth.pins = {topRow(cloth)};
  cloth.damping = 20;
  cloth.shear.stiffness = 20;
  cloth.drag = 0.4f;
  model::Scene scene = sceneOf({cloth});
  scene.environment.wind = model::Vec3(0.5f, 0, 1);
  Running running(scene);
  reference::ReferenceSimulation reference(scene);
  setState(reference, running.state());
  const reference::TickInputs inputs = referenceInputs(inputsOf(scene));
  double largest = 0;
  for (int tick = 0; tick < 200; ++tick) {
    running.tick(inputsOf(scene));
    reference.tick(inputs);
    if (tick % 20 != 19) continue;
    largest = std::max(largest, largestDistance(running.state(), reference));
  }
  const double moved = largestDistance(simulation::restState(scene.cloths), reference);
  const double tolerance = 3 * 10 * std::sqrt(2000.0) * kRounding * 0.5;
  EXPECT_LT(largest, tolerance);
  EXPECT_GT(moved, 1000 * tolerance);
  RecordProperty("largestDistance", std::to_string(largest));
}

// Nodes never end a tick inside the sphere, because the collision comes last in a substep. The remaining
// error is the rounding of the centre, the normal and their sum. Each is within an ulp of their size of 0.5
// m.
TEST_F(Behaviour, AClothDroppedOnASphereRestsOnItsSurface) {
  model::Cloth cloth = calmCloth(33, 33);
  cloth.grid.pose.orientation =
      model::Quaternion(Eigen::AngleAxisf(std::acos(-1.0f) / 2, model::Vec3::UnitX()));
  cloth.grid.pose.position = model::Vec3(0, 0.26f, 0.32f);
  cloth.thickness = 0.005f;
  cloth.damping = 1;
  const model::Scene scene = sceneOf({cloth});
  const model::Vec3 centre = model::Vec3(0, 0, 0);
  const double radius = 0.2;
  Running running(scene);
  double deepest = 0;
  bool touched = false;
  for (int tick = 0; tick < 144; ++tick) {
    running.tick(inputsOf(scene, {{model::Sphere{static_cast<float>(radius)}, {centre}, {centre}, 1}}));
    for (const model::Vec3& position : running.state().positions) {
      const double distance = position.cast<double>().norm();
      deepest = std::max(deepest, radius + 0.005 - distance);
      touched = touched || distance < radius + 0.0051;
    }
  }
  EXPECT_TRUE(touched);
  EXPECT_LT(deepest, 4 * 2 * kRounding * 0.5);
  EXPECT_LT(deepest, 1e-5 * radius);
}

// A node rests on a huge sphere that moves sideways. With friction it moves with the sphere; without friction
// it stays.
TEST_F(Behaviour, FrictionCarriesAClothAlongWithASphere) {
  const float radius = 100;
  const auto carried = [&](float friction) {
    model::Cloth cloth = calmCloth(5, 5);
    cloth.grid.pose.orientation =
        model::Quaternion(Eigen::AngleAxisf(std::acos(-1.0f) / 2, model::Vec3::UnitX()));
    cloth.damping = 0;
    cloth.friction = friction;
    cloth.thickness = 0;
    const model::Scene scene = sceneOf({cloth});
    Running running(scene);
    const float speed = 0.2f;
    for (int tick = 0; tick < 72; ++tick) {
      const auto at = [&](int t) { return model::Vec3(speed / 72 * static_cast<float>(t), -radius, 0); };
      running.tick(inputsOf(scene, {{model::Sphere{radius}, {at(tick)}, {at(tick + 1)}, 1}}));
    }
    return running.state().velocities[12].x();
  };
  EXPECT_NEAR(carried(1), 0.2, 0.01);
  // The sphere falls away sideways by 2e-3 of its slope: that is all the push there is.
  EXPECT_LT(std::abs(carried(0)), 0.03);
}

// Coulomb: a sheet sliding with v loses mu g a second. On a sphere of 100 m it is flat to 1e-3.
TEST_F(Behaviour, FrictionSlowsByItsCoefficientTimesTheLoad) {
  model::Cloth cloth = calmCloth(5, 5);
  cloth.grid.pose.orientation =
      model::Quaternion(Eigen::AngleAxisf(std::acos(-1.0f) / 2, model::Vec3::UnitX()));
  cloth.damping = 0;
  cloth.friction = 0.25f;
  cloth.thickness = 0;
  const model::Scene scene = sceneOf({cloth});
  NodeState state = simulation::restState(scene.cloths);
  for (model::Vec3& velocity : state.velocities) velocity.x() = 1.0f;
  Running running(scene);
  running.restore(state);
  const model::Vec3 centre(0, -100, 0);
  const int ticks = 18;
  for (int tick = 0; tick < ticks; ++tick)
    running.tick(inputsOf(scene, {{model::Sphere{100}, {centre}, {centre}, 1}}));
  double mean = 0;
  for (const model::Vec3& velocity : running.state().velocities) mean += double{velocity.x()} / 25;
  const double seconds = ticks / 72.0;
  EXPECT_NEAR(mean, 1 - 0.25 * 9.81 * seconds, 0.02);
}

}  // namespace
}  // namespace clothstream::tests
