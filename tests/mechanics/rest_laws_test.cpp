// SPDX-License-Identifier: MIT
// Cloth whose energy is at its minimum stays there. docs/mechanics.md has the figures.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/model/material.h"
#include "tests/mechanics/rows.h"
#include "tests/mechanics/ways.h"
#include "tests/simulation/scenes.h"

namespace clothstream::mechanics {
namespace {

// Layers 2 cm wide, 0.5 mm apart, folded to and fro: hinges of nearly 180 degrees at every second edge.
model::Cloth pleats(const model::Solver& solver) {
  constexpr std::uint32_t kFolds = 9, kColumns = 3;
  model::MeshShape shape = model::shapeOf(model::grid(kFolds, kColumns));
  for (std::uint32_t row = 0; row < kFolds; ++row)
    for (std::uint32_t column = 0; column < kColumns; ++column)
      shape.positions[kColumns * row + column] =
          model::Vec3(0.02f * static_cast<float>(column), 1.5f + (row % 2 == 0 ? 0.0f : 0.02f),
                      0.0005f * static_cast<float>(row));
  model::Cloth cloth;
  cloth.name = "pleats";
  cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(shape));
  cloth.mass = 0.03f;
  cloth.structural = {30, 0.0005f};
  cloth.shear = {10, 0.0002f};
  cloth.dihedralBending = 8e-6f;
  cloth.damping = cloth.drag = cloth.lift = 0;
  cloth.solver = solver;
  return cloth;
}

// Kinetic energy of a node after some time without gravity, J.
double energyAtRest(const model::Cloth& cloth, double seconds) {
  model::Scene scene = tests::sceneOf({cloth});
  scene.simulationRate = scene.streamRate = 20;
  scene.substeps = 32;
  scene.environment.gravity = model::Vec3::Zero();
  tests::Running running(scene);
  const simulation::NodeState state = after(running, scene, seconds);
  const std::vector<double> masses = model::nodeMasses(cloth);
  double energy = 0;
  for (std::size_t i = 0; i < masses.size(); ++i)
    energy += masses[i] / 2 * state.velocities[i].cast<double>().squaredNorm();
  return energy / static_cast<double>(masses.size());
}

class RestLaws : public tests::GpuTest, public testing::WithParamInterface<Way> {};

TEST_P(RestLaws, PleatsAtRestStayAtRest) {
  const double energy = energyAtRest(pleats(GetParam().solver), 20);
  EXPECT_LT(energy, 1e-9);
  model::Cloth cloth = pleats(GetParam().solver);
  // Layers do not touch.
  cloth.selfCollision = model::SelfCollision{.radius = 0.0002f};
  cloth.tethers = model::Tethers{};
  cloth.coarse = model::CoarseCorrection{.cells = 2};
  const double withCoarse = energyAtRest(cloth, 1);
  cloth.coarse.reset();
  cloth.selfCollision->nothingPasses = true;
  const double passed = energyAtRest(cloth, 1);
  EXPECT_LT(withCoarse, 1e-9);
  EXPECT_LT(passed, 1e-9);
  expectRow({GetParam().name, figure(energy), figure(withCoarse), figure(passed)});
}

// A square of 12x12 nodes of cotton, 30 cm, 10 g.
model::Cloth cotton() {
  model::Cloth cloth;
  cloth.name = "cloth";
  cloth.grid = {.rows = 12, .columns = 12, .width = 0.3f, .height = 0.3f};
  model::makeOf(*model::findMaterial("cotton"), cloth);
  return cloth;
}

// Speed of the fastest node after four seconds.
double restlessness(const model::Scene& scene) {
  tests::Running running(scene);
  simulation::TickInputs inputs = tests::inputsOf(scene);
  inputs.colliders = simulation::inputsAt(scene, 0).colliders;
  for (std::uint32_t tick = 0; tick < 4 * scene.simulationRate; ++tick)
    EXPECT_TRUE(running.tick(inputs).healthy);
  double fastest = 0;
  for (const model::Vec3& velocity : running.state().velocities)
    fastest = std::max(fastest, double{velocity.norm()});
  return fastest;
}

model::Scene drapedAt(float x) {
  model::Cloth cloth = cotton();
  cloth.grid.pose = {model::Vec3(x, 1.12f, 0.15f), tests::turned(90, model::Vec3::UnitX())};
  model::Scene scene = tests::sceneOf({cloth});
  model::Collider& ball = scene.colliders.emplace_back();
  ball.name = "ball";
  ball.pose.position = model::Vec3(x, 1, 0);
  return scene;
}

model::Scene hungAt(float x) {
  model::Cloth cloth = cotton();
  cloth.grid.pose.position = model::Vec3(x, 1, 0);
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = 11, .columnStep = 11}};
  return tests::sceneOf({cloth});
}

class FarLaws : public tests::GpuTest, public testing::WithParamInterface<int> {};

TEST_P(FarLaws, ClothFarFromTheOriginIsNearlyStill) {
  const auto x = static_cast<float>(GetParam());
  const double draped = restlessness(drapedAt(x)), hung = restlessness(hungAt(x));
  EXPECT_LT(draped, 0.05);
  EXPECT_LT(hung, 0.01);
  expectRow({std::to_string(GetParam()), figure(draped), figure(hung)});
}

INSTANTIATE_TEST_SUITE_P(Metres, FarLaws, testing::Values(0, 100, 500, 950),
                         [](const auto& metres) { return std::to_string(metres.param); });

INSTANTIATE_TEST_SUITE_P(Solvers, RestLaws, testing::ValuesIn(ways()),
                         [](const auto& way) { return lettersOf(way.param.name); });

}  // namespace
}  // namespace clothstream::mechanics
