// SPDX-License-Identifier: MIT
// The paper's ACAD on the device against a dense solve that was written from the paper alone.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "server/model/springs.h"
#include "tests/simulation/paper_acad.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;

class PaperAcad : public GpuTest {};

// m. Largest distance from the oracle that a substep may have.
constexpr double kOracleDistance = 1e-6;

model::Solver paperSolver(bool bendConstraints) {
  return {.kind = model::SolverKind::acad,
          .bendConstraints = bendConstraints,
          .compliance = {},
          .iterations = kSolveIterations,
          .tolerance = 1e-7f,
          .acadMode = model::AcadMode::paper};
}

// One substep a tick, of 1 / 200 s as in the paper.
model::Scene steppedScene(model::Cloth cloth) {
  model::Scene scene = sceneOf({std::move(cloth)});
  scene.simulationRate = scene.streamRate = 200;
  scene.substeps = 1;
  return scene;
}

// Soft springs, so that many are stretched beyond the threshold.
model::Cloth softCloth(std::uint32_t rows, std::uint32_t columns, bool bendConstraints) {
  model::Cloth cloth = calmCloth(rows, columns);
  cloth.structural = {20, 0.02f};
  cloth.shear = {10, 0.01f};
  cloth.bend = {4, 0.01f};
  cloth.pins = {
      {.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = columns - 1, .columnStep = columns - 1}};
  cloth.solver = paperSolver(bendConstraints);
  return cloth;
}

PaperSpring paperKindOf(const model::Spring& spring, bool mayConstrain) {
  PaperSpring kind;
  kind.stiffness = spring.stiffness;
  kind.damping = spring.damping;
  kind.mayConstrain = mayConstrain;
  return kind;
}

PaperSystem paperSystemOf(const model::Scene& scene, std::vector<PaperSpring> springs) {
  const model::Cloth& cloth = scene.cloths.front();
  PaperSystem system;
  system.springs = std::move(springs);
  system.masses.resize(cloth.nodeCount());
  const std::vector<double> masses = model::nodeMasses(cloth);
  for (const std::uint8_t pinned : model::pinnedNodes(cloth)) {
    system.masses[static_cast<Eigen::Index>(system.fixed.size())] = masses[system.fixed.size()];
    system.fixed.push_back(pinned != 0);
  }
  system.gravity = scene.environment.gravity.cast<double>();
  system.drag = cloth.damping;
  system.threshold = cloth.solver.activation;
  return system;
}

PaperSystem paperGridSystem(const model::Scene& scene) {
  const model::Cloth& cloth = scene.cloths.front();
  const bool bend = cloth.solver.bendConstraints;
  return paperSystemOf(scene,
                       paperSprings({.rows = cloth.grid.rows,
                                     .columns = cloth.grid.columns,
                                     .rowSpacing = double{cloth.grid.height} / (cloth.grid.rows - 1),
                                     .columnSpacing = double{cloth.grid.width} / (cloth.grid.columns - 1),
                                     .structural = paperKindOf(cloth.structural, true),
                                     .shear = paperKindOf(cloth.shear, true),
                                     .bend = paperKindOf(cloth.bend, bend)}));
}

PaperState paperStateOf(const NodeState& state) {
  PaperState paper;
  const auto size = static_cast<Eigen::Index>(3 * state.positions.size());
  paper.q.resize(size);
  paper.velocity.resize(size);
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    paper.q.segment<3>(static_cast<Eigen::Index>(3 * i)) = state.positions[i].cast<double>();
    paper.velocity.segment<3>(static_cast<Eigen::Index>(3 * i)) = state.velocities[i].cast<double>();
  }
  return paper;
}

struct OracleDistance {
  double most = 0;                                  // m, largest distance after any substep
  std::size_t fewest = 1'000'000, constraints = 0;  // of any substep; the most of any substep
};

// Every substep starts from the device's state, so that each has only its own error.
OracleDistance compareWithOracle(const model::Scene& scene, const PaperSystem& system, Running& running,
                                 int substeps) {
  OracleDistance distance;
  for (int substep = 0; substep < substeps; ++substep) {
    const PaperState before = paperStateOf(running.state());
    const std::size_t active = paperConstraints(system, before).size();
    const PaperState expected = paperStep(system, before, 1.0 / scene.simulationRate);
    EXPECT_TRUE(running.tick(inputsOf(scene)).healthy);
    const PaperState found = paperStateOf(running.state());
    for (Eigen::Index i = 0; i < found.q.size(); i += 3)
      distance.most = std::max(distance.most, (found.q - expected.q).segment<3>(i).norm());
    distance.fewest = std::min(distance.fewest, active);
    distance.constraints = std::max(distance.constraints, active);
    EXPECT_EQ(running.solves().front().constraints, active) << substep;
  }
  return distance;
}

void expectLikeThePaper(const model::Scene& scene, const PaperSystem& system, const NodeState& start,
                        int substeps, simulation::SimulationOptions options = {}) {
  Running running(scene, options);
  running.restore(start);
  const OracleDistance distance = compareWithOracle(scene, system, running, substeps);
  ::testing::Test::RecordProperty("distance", std::to_string(distance.most * 1e9) + " nm");
  EXPECT_LT(distance.most, kOracleDistance);
  EXPECT_GT(distance.constraints, 10u);
  EXPECT_LT(distance.constraints, system.springs.size());
}

TEST_F(PaperAcad, MovesAScatteredSheetAsADenseSolve) {
  for (const bool bend : {false, true}) {
    SCOPED_TRACE(bend);
    const model::Scene scene = steppedScene(softCloth(9, 14, bend));
    std::mt19937 random(4);
    expectLikeThePaper(scene, paperGridSystem(scene), randomState(scene, random, 0.002f, 0.2f), 1);
  }
}

// The sheet falls into its constraints, with several workgroups and with one. It is not flat: the two
// diagonals of a flat quad make the system singular, and floats then need many more iterations.
TEST_F(PaperAcad, MovesAFallingSheetAsADenseSolve) {
  model::Cloth sheet = softCloth(8, 9, false);
  sheet.solver.iterations = 200;
  sheet.solver.tolerance = 1e-6f;
  const model::Scene scene = steppedScene(std::move(sheet));
  std::mt19937 random(5);
  const NodeState start = randomState(scene, random, 0.001f, 0.1f);
  for (const std::uint32_t wholeNodes : {0u, 4096u})
    expectLikeThePaper(scene, paperGridSystem(scene), start, 25, {.solveWholeNodes = wholeNodes});
}

model::Scene paperDisc() {
  model::Cloth disc = discCloth(5);
  disc.structural = {20, 0.02f};
  disc.shear = {10, 0.01f};
  disc.bend = {4, 0.01f};
  disc.pinnedVertices = {0};
  disc.solver = paperSolver(false);
  return steppedScene(std::move(disc));
}

PaperSystem paperMeshSystem(const model::Scene& scene) {
  const model::Cloth& cloth = scene.cloths.front();
  std::vector<PaperSpring> springs;
  for (const model::SpringLink& link : model::springLinks(cloth)) {
    PaperSpring spring =
        paperKindOf(model::springOf(cloth, link.kind), model::isConstraint(cloth.solver, link.kind));
    spring.one = link.a;
    spring.two = link.b;
    spring.restLength = link.restLength;
    springs.push_back(spring);
  }
  return paperSystemOf(scene, std::move(springs));
}

TEST_F(PaperAcad, MovesAMeshAsADenseSolve) {
  const model::Scene scene = paperDisc();
  expectLikeThePaper(scene, paperMeshSystem(scene), simulation::restState(scene.cloths), 40);
}

using Ends = std::set<std::pair<std::uint32_t, std::uint32_t>>;

Ends sortedEnds(const std::vector<std::uint32_t>& ends) {
  Ends sorted;
  for (std::size_t i = 0; i < ends.size(); i += 2)
    EXPECT_TRUE(sorted.insert(std::minmax({ends[i], ends[i + 1]})).second) << ends[i] << ' ' << ends[i + 1];
  return sorted;
}

// One substep from a scattered state: the constraints are the springs that are then too long.
void expectNamed(const model::Scene& scene, const PaperSystem& system, std::uint32_t wholeNodes) {
  std::mt19937 random(8);
  Running running(scene, {.solveWholeNodes = wholeNodes});
  for (int round = 0; round < 2; ++round) {
    const NodeState start = randomState(scene, random, 0.002f, 0.2f);
    running.restore(start);
    std::vector<std::uint32_t> expected;
    for (const std::size_t spring : paperConstraints(system, paperStateOf(start)))
      expected.insert(expected.end(), {static_cast<std::uint32_t>(system.springs[spring].one),
                                       static_cast<std::uint32_t>(system.springs[spring].two)});
    EXPECT_GT(expected.size(), 2 * 5u);
    EXPECT_LT(expected.size(), 2 * system.springs.size());
    EXPECT_EQ(sortedEnds(running.tickAndName(inputsOf(scene)).front()), sortedEnds(expected));
  }
  // Nothing is too long in the next one.
  running.restore(simulation::restState(scene.cloths));
  EXPECT_TRUE(running.tickAndName(inputsOf(scene)).front().empty());
}

TEST_F(PaperAcad, NamesItsConstraints) {
  for (const std::uint32_t wholeNodes : {0u, 4096u}) {
    SCOPED_TRACE(wholeNodes);
    const model::Scene scene = steppedScene(softCloth(9, 14, wholeNodes == 0));
    expectNamed(scene, paperGridSystem(scene), wholeNodes);
    // Two columns: the springs to the left below and to the right are between neighbours in the table.
    const model::Scene narrow = steppedScene(softCloth(24, 2, true));
    expectNamed(narrow, paperGridSystem(narrow), wholeNodes);
    const model::Scene mesh = paperDisc();
    expectNamed(mesh, paperMeshSystem(mesh), wholeNodes);
  }
}

// The first cloth's springs come first, as many as a report names.
TEST_F(PaperAcad, NamesAtMostAsManyConstraintsAsAReportHasRoomFor) {
  model::Cloth sheet = softCloth(70, 70, true);
  sheet.solver.iterations = 1;
  model::Cloth disc = paperDisc().cloths.front();
  disc.name = "disc";
  model::Scene both = steppedScene(sheet);
  both.cloths = {disc, sheet};
  // Twice the rest length in every direction: all springs are too long.
  NodeState start = simulation::restState(both.cloths);
  for (model::Vec3& position : start.positions) position *= 2;
  Running running(both);
  running.restore(start);
  const std::vector<std::vector<std::uint32_t>> ends = running.tickAndName(inputsOf(both));
  const std::size_t ofDisc = paperMeshSystem(paperDisc()).springs.size();
  EXPECT_GT(ends[0].size() / 2, 10u);
  EXPECT_LE(ends[0].size() / 2, ofDisc);
  EXPECT_EQ((ends[0].size() + ends[1].size()) / 2, simulation::kMostNamedConstraints);
  EXPECT_GT(running.solves().front().constraints, simulation::kMostNamedConstraints - ends[0].size() / 2);
}

// The reference in server/reference does the same, so that benchmarks may compare with it.
TEST_F(PaperAcad, IsWhatTheReferenceDoes) {
  model::Scene scene = steppedScene(softCloth(9, 14, true));
  scene.cloths.front().solver.tolerance = 1e-12f;
  std::mt19937 random(4);
  const NodeState start = randomState(scene, random, 0.002f, 0.2f);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputsOf(scene)));
  const PaperState expected =
      paperStep(paperGridSystem(scene), paperStateOf(start), 1.0 / scene.simulationRate);
  for (std::size_t i = 0; i < start.positions.size(); ++i)
    EXPECT_LT(
        (reference.cloths().front().positions()[i] - expected.q.segment<3>(static_cast<Eigen::Index>(3 * i)))
            .norm(),
        1e-8);
}

TEST_F(PaperAcad, EqualsMassSpringToTheBitWithoutStretch) {
  model::Cloth cloth = calmCloth(13, 12);
  cloth.pins = {topRow(cloth)};
  cloth.solver = paperSolver(true);
  model::Scene held = sceneOf({cloth});
  held.environment.gravity = model::Vec3(0, -1, 0);  // stretches the cloth by 3 %
  model::Scene free = held;
  free.cloths.front().solver.kind = model::SolverKind::massSpring;
  Running one(held), other(free);
  for (int tick = 0; tick < 30; ++tick)
    EXPECT_EQ(one.tick(inputsOf(held)).stateHash, other.tick(inputsOf(free)).stateHash);
}

TEST_F(PaperAcad, GivesTheSameBitsForEveryPartitionOfWork) {
  model::Cloth disc = discCloth(6);
  disc.name = "disc";
  disc.structural = {8, 0.01f};
  disc.pinnedVertices = {0, 1};
  disc.solver = paperSolver(false);
  disc.solver.iterations = 15;
  model::Cloth sheet = softCloth(30, 41, true);
  sheet.solver.iterations = 15;
  const model::Scene scene = sceneOf({sheet, disc});
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 8, .solveWholeNodes = 1'000'000},
                                                {.workgroupSize = 8, .solveWholeNodes = 0},
                                                {.workgroupSize = 16, .solveWholeNodes = 700},
                                                {.workgroupSize = 64, .solveWholeNodes = 0}};
  expectSameBits(scene, passingBall, 10, ways);
}

class LimitAcad : public GpuTest {};

model::Solver limitSolver() {
  model::Solver solver;
  solver.kind = model::SolverKind::acad;
  return solver;
}

// One tick of one substep from a scattered state.
void expectLimitedAsTheReference(model::Scene scene, unsigned seed,
                                 simulation::SimulationOptions options = {}) {
  scene.substeps = 1;
  scene.simulationRate = 720;
  model::Solver& solver = scene.cloths.front().solver;
  solver.iterations = 300;
  solver.tolerance = kSolveTolerance;
  std::mt19937 random(seed);
  const NodeState start = randomState(scene, random, 0.0025f, 0.5f);
  Running running(scene, options);
  running.restore(start);
  EXPECT_TRUE(running.tick(inputsOf(scene)).healthy);
  EXPECT_GT(running.solves().front().constraints, 10u);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputsOf(scene)));
  // The compliance bounds the condition of the systems by 100. Positions are rounded three times, and a move
  // is at most some millimetres.
  EXPECT_LT(largestDistance(running.state(), reference), 4e-6);
  // Without the limit the nodes would be elsewhere.
  solver.kind = model::SolverKind::massSpring;
  reference::ReferenceSimulation free(scene);
  setState(free, start);
  free.tick(referenceInputs(inputsOf(scene)));
  EXPECT_GT(largestDistance(running.state(), free), 1e-4);
}

TEST_F(LimitAcad, MovesNodesAsTheReference) {
  for (const std::uint32_t wholeNodes : {0u, 4096u}) {
    model::Cloth sheet = calmCloth(9, 14);
    sheet.solver = limitSolver();
    expectLimitedAsTheReference(sceneOf({sheet}), 6, {.solveWholeNodes = wholeNodes});
    model::Cloth disc = discCloth(6);
    disc.pinnedVertices = {0};
    disc.solver = limitSolver();
    expectLimitedAsTheReference(sceneOf({disc}), 7, {.solveWholeNodes = wholeNodes});
  }
}

// The kernel of the forces finds out that nothing needs a solve.
TEST_F(LimitAcad, EqualsMassSpringToTheBitWithoutStretch) {
  model::Cloth cloth = calmCloth(13, 12);
  cloth.pins = {topRow(cloth)};
  cloth.solver = limitSolver();
  model::Scene held = sceneOf({cloth});
  held.environment.gravity = model::Vec3(0, -1, 0);  // stretches the cloth by 3 %
  model::Scene free = held;
  free.cloths.front().solver.kind = model::SolverKind::massSpring;
  Running one(held), other(free);
  for (int tick = 0; tick < 30; ++tick)
    EXPECT_EQ(one.tick(inputsOf(held, {})).stateHash, other.tick(inputsOf(free, {})).stateHash);
}

// The names agree with the number of constraints, whether one workgroup solves or several.
TEST_F(LimitAcad, NamesAsManyConstraintsAsItCounts) {
  model::Cloth disc = discCloth(6);
  disc.name = "disc";
  disc.structural = {8, 0.01f};
  disc.pinnedVertices = {0, 1};
  model::Cloth sheet = softCloth(30, 41, false);
  model::Scene scene = sceneOf({sheet, disc});
  scene.substeps = 4;
  for (model::Cloth& cloth : scene.cloths) cloth.solver = limitSolver();
  std::vector<std::vector<std::uint32_t>> first;
  for (const std::uint32_t wholeNodes : {4096u, 0u}) {
    SCOPED_TRACE(wholeNodes);
    Running running(scene, {.solveWholeNodes = wholeNodes});
    for (int tick = 0; tick < 5; ++tick) running.tick(passingBall(scene, tick));
    const std::vector<std::vector<std::uint32_t>> ends = running.tickAndName(passingBall(scene, 5));
    const std::vector<shared::SolveRecord> solves = running.solves();
    for (std::size_t i = 0; i < ends.size(); ++i) {
      EXPECT_GT(ends[i].size(), 20u);
      EXPECT_EQ(sortedEnds(ends[i]).size(), solves[i].constraints);
    }
    if (first.empty()) first = ends;
    EXPECT_EQ(ends, first);
  }
}

TEST_F(LimitAcad, GivesTheSameBitsForEveryPartitionOfWork) {
  model::Cloth disc = discCloth(6);
  disc.name = "disc";
  disc.structural = {8, 0.01f};
  disc.pinnedVertices = {0, 1};
  disc.solver = limitSolver();
  model::Cloth sheet = softCloth(30, 41, false);
  sheet.solver = limitSolver();
  const model::Scene scene = sceneOf({sheet, disc});
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 8, .solveWholeNodes = 1'000'000},
                                                {.workgroupSize = 8, .solveWholeNodes = 0},
                                                {.workgroupSize = 16, .solveWholeNodes = 700},
                                                {.workgroupSize = 64, .solveWholeNodes = 0}};
  expectSameBits(scene, passingBall, 10, ways);
}

// A sheet at rest that is thrown apart by a single fast node is solved from that substep on: the forces see
// the stretch before it happens.
TEST_F(LimitAcad, SolvesInTheSubstepInWhichASpringFirstBecomesTooLong) {
  model::Cloth cloth = calmCloth(12, 17);
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0;
  cloth.solver = limitSolver();
  model::Scene scene = sceneOf({cloth});
  scene.substeps = 1;
  NodeState start = simulation::restState(scene.cloths);
  // 0.02 m apart, 1 / 72 s: 0.3 m/s stretch a spring by a fifth.
  start.velocities[5 * 17 + 8] = model::Vec3(0.3f, 0, 0);
  Running running(scene);
  running.restore(start);
  running.tick(inputsOf(scene));
  EXPECT_GT(running.solves().front().constraints, 0u);
}

std::uint64_t dispatchesOf(const model::Scene& scene) {
  Running running(scene);
  return running.dispatches(inputsOf(scene, {}));
}

// A solve that is not needed is one dispatch without workgroups.
TEST_F(LimitAcad, NeedsOneDispatchInASubstepMoreThanMassSpring) {
  model::Cloth cloth = calmCloth(40, 41);
  const model::Scene free = sceneOf({cloth});
  for (const model::AcadMode mode : {model::AcadMode::limit, model::AcadMode::paper}) {
    cloth.solver = limitSolver();
    cloth.solver.acadMode = mode;
    EXPECT_EQ(dispatchesOf(sceneOf({cloth})), dispatchesOf(free) + free.substeps);
  }
}

// A sheet falls until nearly all of its springs are stretched. A software device then takes wide workgroups.
TEST_F(LimitAcad, ContinuesLongSolvesWithTheSameBits) {
  model::Cloth sheet = softCloth(13, 14, true);
  sheet.solver.iterations = 240;
  sheet.solver.tolerance = 1e-9f;
  sheet.structural.stiffness = sheet.shear.stiffness = 2;
  sheet.solver.acadMode = model::AcadMode::limit;
  sheet.solver.compliance = 1e-5f;
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 8, .solveWholeNodes = 1'000},
                                                {.workgroupSize = 8, .solveWholeNodes = 0},
                                                {.workgroupSize = 64, .solveWholeNodes = 1'000}};
  expectSameBits(sceneOf({sheet}), passingBall, 3, ways);
}

}  // namespace
}  // namespace clothstream::tests
