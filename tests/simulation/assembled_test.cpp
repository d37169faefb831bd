// SPDX-License-Identifier: MIT
// Constraints whose matrices are assembled: against the double-precision system and the matrix-free path.
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "server/model/springs.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::ConstraintPath;
using model::SolverKind;
using simulation::NodeState;
using simulation::StateSnapshot;

class Assembled : public GpuTest {};

model::Scene withPath(model::Scene scene, ConstraintPath path) {
  for (model::Cloth& cloth : scene.cloths) cloth.solver.path = path;
  return scene;
}

double rowsOf(const model::Scene& scene) {
  double rows = 0;
  for (const model::Cloth& cloth : scene.cloths)
    rows += static_cast<double>(model::systemLinks(cloth).size());
  return rows;
}

// Largest error that the solve may leave in positions, m. Let w be the largest inverse mass, c >= 0.01 w, and
// rho the remaining residual b - A lambda. The error of the nodes is at most |M^-1 J^T A^-1 rho| <= |rho|
// sqrt(w) / (2 sqrt(c)) = 5 |rho|. The length of b is `side`. Two terms make up rho: the tolerance, and the
// rounding of A lambda. Entries of A have an error of 1e-6. |A| <= 24 w, because J^T J is at most twice the
// springs of a node. |lambda| <= 5 |b| / w, because b is J times a vector up to rounding. In addition, b is
// rounded in two positions of each row.
double errorOfSolve(double rows, double side) {
  return 5 * (double{kSolveTolerance} + 1e-6 * 24 * 5) * std::sqrt(rows) * side +
         5 * std::sqrt(rows) * 2 * kRounding * kExtent;
}

constexpr double kDisplaced = 0.007;  // of a length, two ends of which are off by up to 2 mm an axis

struct Compared {
  std::uint32_t iterations = kSolveIterations;
  float tolerance = kSolveTolerance;
  std::vector<model::Pose> attachments = {};
};

// One substep from a random state.
void expectLikeSolution(model::Scene scene, unsigned seed, simulation::SimulationOptions options = {},
                        Compared compared = {}) {
  scene.substeps = 1;
  scene.simulationRate = 720;
  for (model::Cloth& cloth : scene.cloths) {
    cloth.solver.iterations = compared.iterations;
    cloth.solver.tolerance = compared.tolerance;
  }
  std::mt19937 random(seed);
  const NodeState start = randomState(scene, random, 0.002f, 0.5f);
  simulation::TickInputs inputs = inputsOf(scene);
  inputs.attachments = compared.attachments;
  const auto referenceAfter = [&](const model::Scene& of) {
    reference::ReferenceSimulation reference(of);
    setState(reference, start);
    reference.tick(referenceInputs(inputs));
    return reference;
  };
  Running running(scene, options);
  running.restore(start);
  EXPECT_TRUE(running.tick(inputs).healthy);
  const NodeState state = running.state();
  const reference::ReferenceSimulation expected = referenceAfter(scene);
  const double tolerance = errorOfSolve(rowsOf(scene), kDisplaced);
  EXPECT_LT(largestDistance(state, expected), tolerance);
  EXPECT_LT(largestSpeedDifference(state, expected), 720 * tolerance);
  for (const shared::SolveRecord& solve : running.solves()) {
    EXPECT_LE(solve.iterations, compared.iterations);
    if (solve.iterations < compared.iterations) {
      EXPECT_LE(solve.residual, compared.tolerance);
    }
  }
  // Without the solve, or with one iteration less if there are few, the nodes would be elsewhere. So the
  // comparison can fail.
  for (model::Cloth& cloth : scene.cloths)
    if (compared.iterations < kSolveIterations)
      --cloth.solver.iterations;
    else
      cloth.solver.compliance = 1;
  EXPECT_GT(largestDistance(state, referenceAfter(scene)), 2 * tolerance);
}

model::Cloth disc(std::uint32_t rings) {
  model::Cloth cloth = assembled(discCloth(rings));
  cloth.name = "disc";
  cloth.mass = 0.01f * static_cast<float>(cloth.nodeCount());
  cloth.pinnedVertices = {0, 1};
  return cloth;
}

TEST_F(Assembled, MoveNodesAsTheReferenceOnEveryShapeOfGrid) {
  const std::pair<std::uint32_t, std::uint32_t> shapes[] = {{2, 2}, {2, 7}, {9, 3}, {17, 23}};
  unsigned seed = 1;
  for (const auto& [rows, columns] : shapes) {
    SCOPED_TRACE(::testing::Message() << rows << " x " << columns);
    model::Cloth cloth = assembled(calmCloth(rows, columns));
    cloth.pins = {topRow(cloth)};
    expectLikeSolution(sceneOf({cloth}), seed++);
  }
}

TEST_F(Assembled, MoveNodesAsTheReferenceWithPartialCorrection) {
  model::Cloth cloth = assembled(calmCloth(9, 8));
  cloth.solver.correctionFraction = 0.125f;
  expectLikeSolution(sceneOf({cloth}), 8);
}

TEST_F(Assembled, MoveNodesAsTheReferenceWithBendSprings) {
  expectLikeSolution(sceneOf({assembled(calmCloth(12, 11), true)}), 5);
}

TEST_F(Assembled, MoveMeshesAsTheReference) {
  expectLikeSolution(sceneOf({assembled(calmCloth(6, 9)), disc(7)}), 7);
}

// Attached nodes have a prescribed velocity, which is part of b.
TEST_F(Assembled, FollowAttachmentsAsTheReference) {
  model::Cloth cloth = assembled(calmCloth(8, 7));
  model::Attachment rod;
  rod.name = "rod";
  rod.ranges = {topRow(cloth)};
  cloth.attachments = {rod};
  Compared compared;
  compared.attachments = {{model::Vec3(0.0006f, 0.0008f, -0.0003f)}};
  expectLikeSolution(sceneOf({cloth}), 11, {}, compared);
}

TEST_F(Assembled, MoveNodesAsTheReferenceWithSeveralWorkgroups) {
  expectLikeSolution(sceneOf({assembled(calmCloth(21, 26)), disc(7)}), 9, {.solveWholeNodes = 0});
}

// Both paths have the same iterates, not only the same limit ([Va21] Eq. 12-17). There are so few iterations
// that rounding has not grown.
TEST_F(Assembled, MoveAsFarAsTheReferenceInFewIterations) {
  for (const std::uint32_t wholeNodes : {1'000'000u, 0u})
    for (const std::uint32_t iterations : {1u, 2u, 4u}) {
      SCOPED_TRACE(::testing::Message() << iterations << " iterations, " << wholeNodes);
      expectLikeSolution(sceneOf({assembled(calmCloth(13, 9), true)}), 10, {.solveWholeNodes = wholeNodes},
                         {.iterations = iterations, .tolerance = 0});
    }
}

// From a random state, three substeps. What one is off by stays in the velocity: n^2 / 2 times as much after
// n, of two paths twice that.
TEST_F(Assembled, MoveAsTheMatrixFreePathDoes) {
  model::Cloth cloth = assembled(calmCloth(8, 7));
  cloth.pins = {{.firstRow = 0, .lastRow = 2, .firstColumn = 0, .lastColumn = 6}};
  model::Scene scene = sceneOf({cloth, disc(3)});
  scene.simulationRate = 240;
  scene.substeps = 3;
  for (model::Cloth& one : scene.cloths) {
    one.solver.iterations = kSolveIterations;
    one.solver.tolerance = kSolveTolerance;
  }
  std::mt19937 random(12);
  const NodeState start = randomState(scene, random, 0.002f, 0.5f);
  const auto after = [&](const model::Scene& of) {
    Running running(of);
    running.restore(start);
    EXPECT_TRUE(running.tick(inputsOf(of)).healthy);
    return running.state();
  };
  const auto apart = [](const NodeState& a, const NodeState& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.positions.size(); ++i)
      most = std::max(most, (a.positions[i] - b.positions[i]).cast<double>().norm());
    return most;
  };
  const double tolerance = 3 * 3 * errorOfSolve(rowsOf(scene), kDisplaced);
  const NodeState state = after(scene);
  EXPECT_LT(apart(state, after(withPath(scene, ConstraintPath::matrixFree))), tolerance);
  for (model::Cloth& one : scene.cloths) one.solver.compliance = 1;
  EXPECT_GT(apart(state, after(scene)), 2 * tolerance);
}

// Pinned nodes alone give nothing to solve. Springs between pinned nodes make no rows.
TEST_F(Assembled, KeepPinnedNodesInPlace) {
  model::Cloth stiff = assembled(calmCloth(5, 4), true);
  stiff.pins = {{.firstRow = 0, .lastRow = 4, .firstColumn = 0, .lastColumn = 3}};
  model::Cloth half = assembled(calmCloth(8, 9), true);
  half.name = "half";
  half.pins = {{.firstRow = 0, .lastRow = 4, .firstColumn = 0, .lastColumn = 8}};
  for (const std::uint32_t wholeNodes : {1'000'000u, 0u}) {
    const model::Scene scene = sceneOf({stiff, half});
    Running running(scene, {.solveWholeNodes = wholeNodes});
    std::vector<simulation::ClothReport> reports;
    for (int tick = 0; tick < 10; ++tick) reports = running.tickAndReport(inputsOf(scene));
    EXPECT_EQ(reports[0].activeConstraints, 0u);
    EXPECT_EQ(reports[0].iterations, 0u);
    EXPECT_EQ(reports[1].activeConstraints, model::systemLinks(half).size());
    EXPECT_GT(reports[1].iterations, 0u);
    const NodeState state = running.state(), start = simulation::restState(scene.cloths);
    const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
    for (std::size_t i = 0; i < masses.size(); ++i)
      if (masses[i] == 0) {
        EXPECT_EQ(state.positions[i], start.positions[i]) << i;
      }
  }
}

// [Va21]'s system is singular and in general has no solution. A few iterations hold a sheet. With more
// iterations its nodes become unstable, in double precision too.
TEST_F(Assembled, HoldASheetWithoutComplianceInFewIterations) {
  model::Cloth cloth = assembled(calmCloth(20, 20), true);
  cloth.pins = {topRow(cloth)};
  cloth.damping = 2;
  cloth.solver.compliance = 0;
  model::Scene scene = sceneOf({cloth});
  std::mt19937 random(4);
  const NodeState start = randomState(scene, random, 0.002f, 0.5f);
  Running running(scene);
  running.restore(start);
  std::vector<simulation::ClothReport> reports;
  for (int tick = 0; tick < 30; ++tick) reports = running.tickAndReport(inputsOf(scene));
  EXPECT_LT(reports[0].strainMax, 0.01f);

  scene.cloths[0].solver.iterations = 200;
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputsOf(scene)));
  EXPECT_GT(reference.cloths().front().strain().max, 1);
}

// Grids and meshes, large and small, together with cloths of other solvers and a ball.
model::Scene systems() {
  model::Cloth held = assembled(calmCloth(37, 29), true);
  held.pins = {topRow(held)};
  held.name = "held";
  model::Cloth free = calmCloth(9, 14);
  free.name = "free";
  free.pins = {topRow(free)};
  model::Cloth small = assembled(calmCloth(5, 3));
  small.name = "small";
  small.solver.tolerance = 0.1f;
  model::Cloth other = small;
  other.name = "other";
  other.solver.path = ConstraintPath::matrixFree;
  model::Cloth round = disc(10);
  round.solver.iterations = 7;
  model::Scene scene = sceneOf({held, free, round, other, small});
  scene.substeps = 4;
  return scene;
}

TEST_F(Assembled, GiveTheSameBitsForEveryPartitionOfWork) {
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 8, .solveWholeNodes = 1'000'000},
                                                {.workgroupSize = 8, .solveWholeNodes = 0},
                                                {.workgroupSize = 0, .solveWholeNodes = 700},
                                                {.workgroupSize = 16, .solveWholeNodes = 700},
                                                {.workgroupSize = 64, .solveWholeNodes = 0},
                                                {.workgroupSize = 100, .solveWholeNodes = 1'000'000}};
  expectSameBits(systems(), passingBall, 10, ways);
}

TEST_F(Assembled, ReportTheSameForEveryPartitionOfWork) {
  const model::Scene scene = systems();
  for (const auto& reports :
       expectSameReports(scene, passingBall, {.solveWholeNodes = 1'000'000}, {.solveWholeNodes = 0}))
    for (std::size_t i = 0; i < reports.size(); ++i)
      if (model::isAssembled(scene.cloths[i].solver)) {
        EXPECT_EQ(reports[i].activeConstraints, model::systemLinks(scene.cloths[i]).size());
        EXPECT_GT(reports[i].iterations, 0u);
      }
}

// More iterations than one dispatch may make if a single workgroup solves.
TEST_F(Assembled, GiveTheSameBitsInSeveralDispatches) {
  model::Cloth cloth = assembled(calmCloth(37, 29), true);
  cloth.pins = {topRow(cloth)};
  cloth.solver.iterations = 150;
  cloth.solver.tolerance = 0;
  const model::Scene scene = sceneOf({cloth});
  Running whole(scene, {.solveWholeNodes = 1'000'000}), parts(scene, {.solveWholeNodes = 0});
  for (int tick = 0; tick < 3; ++tick)
    ASSERT_EQ(whole.tick(inputsOf(scene)).stateHash, parts.tick(inputsOf(scene)).stateHash);
  EXPECT_EQ(whole.solves().front().iterations, 150u);
  EXPECT_EQ(whole.solves().front().residual, parts.solves().front().residual);
}

TEST_F(Assembled, GiveTheSameHashesInLongRuns) {
  model::Scene scene = systems();
  scene.substeps = 1;
  scene.simulationRate = 288;
  for (model::Cloth& cloth : scene.cloths) cloth.solver.iterations = 4;
  expectSameLongRuns(scene, passingBall, {.workgroupSize = 16, .solveWholeNodes = 0});
}

// The hash is the same on every device.
TEST_F(Assembled, ReachTheHashOfEveryOtherDevice) {
  EXPECT_EQ(hashAfter(systems(), passingBall, 12, {.solveWholeNodes = 700}), 0x8fc506c138973b56u);
}

// The path changes and changes back. The state keeps every bit. The motion then has the same bits as that of
// a scene that always had this path and continues from the same state.
TEST_F(Assembled, ReplaceTheMatrixFreePathWithoutAJump) {
  model::Scene scene = sceneOf({assembled(calmCloth(14, 11)), disc(5)});
  scene.cloths[0].pins = {topRow(scene.cloths[0])};
  const simulation::TickInputs inputs = passingBall(scene, 30);
  scene = withPath(scene, ConstraintPath::matrixFree);
  Running changing(scene);
  for (int tick = 0; tick < 6; ++tick) changing.tick(inputs);
  for (const ConstraintPath path :
       {ConstraintPath::assembled, ConstraintPath::matrixFree, ConstraintPath::assembled}) {
    scene = withPath(scene, path);
    scene.cloths[0].solver.bendConstraints = !scene.cloths[0].solver.bendConstraints;
    expectGoesOnAsAlways(changing, scene, inputs, 6);
    EXPECT_EQ(changing.solves().size(), 2u);
  }
  // Another mass and compliance need no other tables.
  scene.cloths[0].mass *= 3;
  scene.cloths[1].solver.compliance = 1e-6f;
  expectGoesOnAsAlways(changing, scene, inputs, 3);
}

}  // namespace
}  // namespace clothstream::tests
