// SPDX-License-Identifier: MIT
// Whole sheets of implicit Euler compared with Newton's method in double precision.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/newton_sheet.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using reference::Vec3;

class Newton : public GpuTest {};

// 24x24 nodes with all three kinds of springs. h^2 k / m is 3.9 at 72 steps a second.
model::Cloth undampedSheet() {
  model::Cloth cloth = calmCloth(24, 24);
  cloth.solver.kind = model::SolverKind::implicitEuler;
  cloth.solver.iterations = 500;
  cloth.solver.tolerance = 1e-6f;
  cloth.structural = {200, 0};
  cloth.shear = {60, 0};
  cloth.bend = {10, 0};
  return cloth;
}

model::Cloth sheetHungByItsEdge() {
  model::Cloth cloth = undampedSheet();
  cloth.pins = {topRow(cloth)};
  return cloth;
}

// Level, and pinned along its whole edge: it sags and is stretched both ways.
model::Cloth sheetInAFrame() {
  model::Cloth cloth = undampedSheet();
  cloth.grid.pose.orientation = turned(-90, model::Vec3::UnitX());
  cloth.pins = {{.firstRow = 0, .lastRow = 23, .rowStep = 23, .firstColumn = 0, .lastColumn = 23},
                {.firstRow = 0, .lastRow = 23, .firstColumn = 0, .lastColumn = 23, .columnStep = 23}};
  return cloth;
}

model::Scene stepScene(const model::Cloth& cloth, std::uint32_t rate) {
  model::Scene scene = sceneOf({cloth});
  scene.simulationRate = scene.streamRate = rate;
  scene.substeps = 1;
  return scene;
}

std::vector<Vec3> placesInDouble(const std::vector<model::Vec3>& positions) {
  std::vector<Vec3> places;
  for (const model::Vec3& position : positions) places.push_back(position.cast<double>());
  return places;
}

NewtonSheet solvedByNewton(const model::Scene& scene) {
  const model::Cloth& cloth = scene.cloths.front();
  const std::vector<std::uint8_t> pinned = model::pinnedNodes(cloth);
  return {{.rows = cloth.grid.rows,
           .columns = cloth.grid.columns,
           .structural = cloth.structural.stiffness,
           .shear = cloth.shear.stiffness,
           .bend = cloth.bend.stiffness,
           .nodeMass = cloth.nodeMass(),
           .gravity = scene.environment.gravity.cast<double>()},
          placesInDouble(model::restPositions(cloth)),
          std::vector<bool>(pinned.begin(), pinned.end())};
}

double farthestNode(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

// Lengths of the structural springs.
std::vector<double> structuralLengths(const model::Cloth& cloth, const std::vector<Vec3>& places) {
  const std::size_t columns = cloth.grid.columns;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i % columns + 1 < columns) lengths.push_back((places[i + 1] - places[i]).norm());
    if (i + columns < places.size()) lengths.push_back((places[i + columns] - places[i]).norm());
  }
  return lengths;
}

// At rest the linearised forces of a step are the forces themselves, so the step does not matter. Within 0.1
// %: the sag of every node, as part of the largest one, and the stretch of every spring that carries a tenth
// of the largest one.
void expectBalanceOfNewton(const model::Cloth& still, std::uint32_t ticks) {
  model::Cloth cloth = still;
  cloth.damping = 4;
  const model::Scene scene = stepScene(cloth, 72);
  Running running(scene);
  for (std::uint32_t tick = 0; tick < ticks; ++tick) running.tick(inputsOf(scene));
  const simulation::NodeState state = running.state();
  for (const model::Vec3& velocity : state.velocities) ASSERT_LT(velocity.norm(), 1e-4f);

  const std::vector<Vec3> rest = placesInDouble(model::restPositions(cloth)),
                          found = placesInDouble(state.positions);
  const std::vector<Vec3> expected = solvedByNewton(scene).balance(rest);
  const double sag = farthestNode(rest, expected);
  EXPECT_GT(sag, 0.005);
  EXPECT_LT(farthestNode(found, expected), 0.001 * sag);
  testing::Test::RecordProperty("sag", std::to_string(sag));
  testing::Test::RecordProperty("farthest", std::to_string(farthestNode(found, expected) / sag));

  const double spacing = model::spacing(cloth.grid).column;
  const std::vector<double> lengths = structuralLengths(cloth, found),
                            exact = structuralLengths(cloth, expected);
  const double most = *std::ranges::max_element(exact) - spacing;
  double worst = 0;
  for (std::size_t i = 0; i < exact.size(); ++i)
    if (exact[i] - spacing > 0.1 * most)
      worst = std::max(worst, std::abs(lengths[i] - exact[i]) / (exact[i] - spacing));
  EXPECT_GT(most, 0.01 * spacing);
  EXPECT_LT(worst, 0.001);
  testing::Test::RecordProperty("worstStretch", std::to_string(worst));
}

TEST_F(Newton, AHungSheetOfImplicitEulerComesToRestInItsBalance) {
  expectBalanceOfNewton(sheetHungByItsEdge(), 720);
}

TEST_F(Newton, AFramedSheetOfImplicitEulerComesToRestInItsBalance) {
  expectBalanceOfNewton(sheetInAFrame(), 720);
}

// The linearisation of a step leaves an error of the second order, so half the step leaves less than half the
// distance of both motions. It is at most 0.5 % of the way at 288 steps a second, where h^2 k / m is 0.24. No
// spring gets longer than 110 %: beyond that it has an additional dashpot, which Newton's method leaves out.
TEST_F(Newton, AFramedSheetOfImplicitEulerFallsAsNewtonsMethodSays) {
  double distances[2];
  for (const std::uint32_t rate : {144u, 288u}) {
    const model::Scene scene = stepScene(sheetInAFrame(), rate);
    Running running(scene);
    const NewtonSheet newton = solvedByNewton(scene);
    const std::vector<Vec3> rest = placesInDouble(model::restPositions(scene.cloths.front()));
    std::vector<Vec3> positions = rest, velocities(rest.size(), Vec3::Zero());
    double way = 0, distance = 0;
    for (std::uint32_t step = 0; step < rate / 12; ++step) {
      running.tick(inputsOf(scene));
      newton.step(positions, velocities, double{scene.cloths.front().damping}, scene.substepSeconds());
      way = std::max(way, farthestNode(rest, positions));
      distance = std::max(distance, farthestNode(placesInDouble(running.state().positions), positions));
    }
    distances[rate / 288] = distance / way;
  }
  testing::Test::RecordProperty("at144", std::to_string(distances[0]));
  testing::Test::RecordProperty("at288", std::to_string(distances[1]));
  EXPECT_LT(distances[1], 0.005);
  EXPECT_LT(distances[1], distances[0] / 2);
}

}  // namespace
}  // namespace clothstream::tests
