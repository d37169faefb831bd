// SPDX-License-Identifier: MIT
// Runs of 1e5 steps, which keep their energy, and of ten seconds, after which a sheet rests on a ball.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;

class LongRuns : public GpuTest {};

// A step conserves E - h k x v / 2 of a linear spring exactly, so E varies by omega h / 2 = 0.63 % and does
// not drift. The phase of (x, -v / omega) is off by as much, which does not grow either; the frequency is
// higher by (omega h)^2 / 24 = 7e-6. Each of 1e5 steps rounds the position to 2e-9 m of an amplitude of 2 mm,
// and the velocity alike. As a random walk that changes E by 0.1 %.
TEST_F(LongRuns, ASpringKeepsItsEnergyAndPeriodOver100000Steps) {
  model::Cloth cloth = calmCloth(2, 2);
  cloth.structural.damping = cloth.damping = 0;
  cloth.shear = cloth.bend = {};
  cloth.pins = {topRow(cloth)};
  model::Scene scene = sceneOf({cloth});
  scene.environment.gravity = model::Vec3::Zero();
  // A tick is about 0.46 periods, so the ticks see all phases.
  scene.simulationRate = scene.streamRate = 49;
  scene.substeps = 230;
  const double omega = std::sqrt(double{cloth.structural.stiffness} / double{cloth.nodeMass()});
  NodeState state = simulation::restState(scene.cloths);
  const double rest = state.positions[2].y();
  for (const std::size_t node : {2, 3}) state.positions[node].y() -= 0.002f;
  Running running(scene);
  running.restore(state);
  const double turn = 2 * std::acos(-1.0), start = 0.002 * omega * 0.002 * omega;
  double least = start, most = start, phase = 0;
  const int ticks = 435;
  for (int tick = 1; tick <= ticks; ++tick) {
    running.tick(inputsOf(scene));
    state = running.state();
    const double x = rest - double{state.positions[2].y()}, v = -double{state.velocities[2].y()};
    const double energy = x * omega * x * omega + v * v;
    least = std::min(least, energy);
    most = std::max(most, energy);
    // The phase of the formula, corrected by less than half a turn.
    phase = omega * tick * scene.tickSeconds();
    phase += std::remainder(std::atan2(-v / omega, x) - phase, turn);
  }
  EXPECT_NEAR(least / start, 1, 0.01);
  EXPECT_NEAR(most / start, 1, 0.01);
  EXPECT_NEAR(phase / (omega * ticks * scene.tickSeconds()), 1, 1e-4);
}

TEST_F(LongRuns, AnUndampedSheetKeepsItsEnergyOver100000Steps) {
  model::Cloth cloth = calmCloth(12, 12);
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = cloth.damping = 0;
  cloth.pins = {topRow(cloth)};
  model::Scene scene = sceneOf({cloth});
  scene.simulationRate = scene.streamRate = 25;
  scene.substeps = 200;
  std::mt19937 random(12);
  const NodeState start = randomState(scene, random, 0, 0.5f);
  const reference::Vec3 gravity = scene.environment.gravity.cast<double>();
  reference::ReferenceSimulation measured(scene);
  const reference::ReferenceCloth& hung = measured.cloths().front();
  const auto energyOf = [&](const NodeState& state) {
    setState(measured, state);
    return hung.kineticEnergy() + hung.elasticEnergy() + hung.gravityEnergy(gravity);
  };
  const double energy = energyOf(start), moving = hung.kineticEnergy();
  Running running(scene);
  running.restore(start);
  double worst = 0;
  for (int tick = 0; tick < 500; ++tick) {
    running.tick(inputsOf(scene));
    worst = std::max(worst, std::abs(energyOf(running.state()) - energy));
  }
  RecordProperty("worst", std::to_string(worst / moving));
  EXPECT_LT(worst, 0.02 * moving);
}

// The scene sphere_drop with twice the damping. No frame has a node in the ball, and ten seconds after its
// start the sheet rests.
TEST_F(LongRuns, ASheetDroppedOnABallRestsAfterTenSeconds) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = 48, .columns = 48, .width = 1.6f, .height = 1.6f, .pose = {}};
  cloth.grid.pose = {model::Vec3(0, 1.5f, -0.8f), turned(-90, model::Vec3::UnitX())};
  cloth.mass = 0.6f;
  cloth.structural = {24, 0.003f};
  cloth.shear = {9, 0.002f};
  cloth.bend = {5, 0.002f};
  cloth.damping = 2;
  cloth.drag = 0.6f;
  cloth.lift = 0.1f;
  cloth.friction = 0.8f;
  cloth.thickness = 0.01f;
  const model::Scene scene = sceneOf({cloth});
  const model::Vec3 centre(0, 0.8f, 0);
  const double radius = 0.4;
  Running running(scene);
  double deepest = 0;
  float fastest = 0;
  for (int tick = 0; tick < 792; ++tick) {
    const simulation::ClothReport report =
        running
            .tickAndReport(
                inputsOf(scene, {{model::Sphere{static_cast<float>(radius)}, {centre}, {centre}, 1}}))
            .front();
    deepest = std::max(deepest, double{report.penetration});
    if (tick < 720 || tick % 8 != 0) continue;
    for (const model::Vec3& velocity : running.state().velocities)
      fastest = std::max(fastest, velocity.norm());
  }
  double nearest = 1, lowest = 1;
  for (const model::Vec3& position : running.state().positions) {
    nearest = std::min(nearest, (position - centre).cast<double>().norm());
    lowest = std::min(lowest, double{position.y()});
  }
  RecordProperty("fastest", std::to_string(fastest));
  EXPECT_EQ(deepest, 0);
  EXPECT_NEAR(nearest, radius + double{cloth.thickness}, 1e-5 * radius);
  EXPECT_LT(lowest, 0.5);  // it drapes
  EXPECT_LT(fastest, 0.001f);
}

}  // namespace
}  // namespace clothstream::tests
