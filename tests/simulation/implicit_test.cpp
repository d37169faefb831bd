// SPDX-License-Identifier: MIT
// Implicit Euler: the solver against the factorised double-precision system, an analytic case, and whole
// runs.
#include <cmath>

#include <gtest/gtest.h>

#include "server/model/springs.h"
#include "server/model/stability.h"
#include "server/reference/implicit_system.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;

class ImplicitEuler : public GpuTest {};

model::Cloth implicitCloth(model::Cloth cloth) {
  cloth.solver.kind = model::SolverKind::implicitEuler;
  return cloth;
}

// Far beyond the stability of explicit springs: h^2 k / m is 7.7 for a structural spring.
model::Cloth stiffCloth(std::uint32_t rows, std::uint32_t columns) {
  model::Cloth cloth = implicitCloth(calmCloth(rows, columns));
  cloth.structural = {400, 0.5f};
  cloth.shear = {200, 0.1f};
  return cloth;
}

model::Scene steps(std::vector<model::Cloth> cloths, std::uint32_t rate) {
  model::Scene scene = sceneOf(std::move(cloths));
  scene.simulationRate = rate;
  scene.streamRate = rate;
  scene.substeps = 1;
  return scene;
}

// Largest error that the solve may leave in velocities, m/s, if it starts with the residual `start`, kg m/s.
// With the error e and the remaining residual rho = A e,
//   m |e|^2 <= e A e = rho A^-1 rho <= rho M^-1 rho <= tolerance^2 start M^-1 start,
// because M is the preconditioner. Therefore |e| <= tolerance |start| / m, where m is the lightest node.
// Float arithmetic computes the right-hand side and products of A from rows with an error of 2e-6 (two
// reciprocal roots). The residual has the same relative error. The free velocities are rounded in addition.
double errorOfSolve(const reference::ImplicitSystem& system, double start, double lightest,
                    double tolerance) {
  return (tolerance + 2 * 2e-6) * (start + system.side().norm()) / lightest;
}

struct StartedSystem {
  reference::ImplicitSystem system;
  double residual;  // its norm, of the velocities at the substep's start
};

StartedSystem systemOf(const model::Scene& scene, const NodeState& start) {
  const model::Cloth& cloth = scene.cloths.front();
  std::vector<reference::ImplicitSpring> springs;
  for (const model::SpringLink& link : model::springLinks(cloth)) {
    const model::Spring& spring = model::springOf(cloth, link.kind);
    springs.push_back({link.a, link.b, spring.stiffness, spring.damping, link.restLength});
  }
  model::Scene free = scene;
  free.cloths.front().solver.kind = model::SolverKind::massSpring;
  reference::ReferenceSimulation simulation(free);
  setState(simulation, start);
  const std::vector<reference::Vec3> positions(simulation.cloths().front().positions().begin(),
                                               simulation.cloths().front().positions().end());
  const std::vector<reference::Vec3> velocities(simulation.cloths().front().velocities().begin(),
                                                simulation.cloths().front().velocities().end());
  simulation.tick(reference::inputsAt(free, 0));
  const std::span<const reference::Vec3> freely = simulation.cloths().front().velocities();
  reference::ImplicitSystem system(springs, positions, velocities, freely,
                                   simulation.cloths().front().inverseMasses(), scene.substepSeconds());
  Eigen::VectorXd back(system.side().size());
  for (std::size_t i = 0; i < freely.size(); ++i)
    back.segment<3>(static_cast<Eigen::Index>(3 * i)) = velocities[i] - freely[i];
  const double residual = (system.side() - system.matrix() * back).norm();
  return {std::move(system), residual};
}

// The cloth starts near its place at rest, `length` times as long.
void expectLikeReference(model::Cloth cloth, std::uint32_t rate, unsigned seed, float length = 1) {
  constexpr float tolerance = 1e-5f;
  cloth.solver.iterations = 500;
  cloth.solver.tolerance = tolerance;
  const model::Scene scene = steps({cloth}, rate);
  std::mt19937 random(seed);
  NodeState start = randomState(scene, random, 0.002f, 0.3f);
  for (model::Vec3& position : start.positions) position.y() *= length;
  Running running(scene);
  running.restore(start);
  const simulation::ClothReport report = running.tickAndReport(inputsOf(scene)).front();
  EXPECT_LE(report.residual, tolerance);
  EXPECT_GT(report.iterations, 1u);

  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputsOf(scene)));
  double lightest = 1;
  for (const double mass : reference.cloths().front().masses()) lightest = std::min(lightest, mass);
  const StartedSystem started = systemOf(scene, start);
  const double error = errorOfSolve(started.system, started.residual, lightest, double{tolerance});
  const double h = scene.substepSeconds();
  const NodeState state = running.state();
  EXPECT_LT(largestSpeedDifference(state, reference), error);
  EXPECT_LT(largestDistance(state, reference), h * error + kRounding * 2);

  // An explicit step would end elsewhere, so the comparison can fail.
  model::Scene explicitly = scene;
  explicitly.cloths.front().solver.kind = model::SolverKind::massSpring;
  reference::ReferenceSimulation other(explicitly);
  setState(other, start);
  other.tick(referenceInputs(inputsOf(scene)));
  EXPECT_GT(largestSpeedDifference(state, other), 4 * error);
}

TEST_F(ImplicitEuler, MovesNodesAsTheReferenceOnEveryShapeOfGrid) {
  const std::pair<std::uint32_t, std::uint32_t> shapes[] = {{2, 2}, {2, 7}, {9, 3}, {17, 23}};
  unsigned seed = 1;
  for (const auto& [rows, columns] : shapes) {
    SCOPED_TRACE(::testing::Message() << rows << " x " << columns);
    model::Cloth cloth = implicitCloth(calmCloth(rows, columns));
    cloth.pins = {topRow(cloth)};
    expectLikeReference(cloth, 720, seed++);
  }
}

TEST_F(ImplicitEuler, MovesStiffClothsAsTheReference) {
  expectLikeReference(stiffCloth(11, 8), 72, 5);
}

TEST_F(ImplicitEuler, MovesMeshesAsTheReference) {
  model::Cloth disc = implicitCloth(discCloth(6));
  disc.pinnedVertices = {0};
  expectLikeReference(disc, 72, 6);
}

TEST_F(ImplicitEuler, CalmsOverlongSpringsAsTheReference) {
  const model::Cloth cloth = stiffCloth(11, 8);
  expectLikeReference(cloth, 72, 7, 6);
  expectLikeReference(model::asMesh(cloth), 72, 7, 6);
}

// Two nodes hang from two pinned nodes by springs along y. Their stretch x obeys x'' = -omega^2 x, and
// implicit Euler gives v' = (v - h omega^2 x) / (1 + h^2 omega^2), x' = x + h v'. Here omega h = 3; explicit
// springs are stable up to 2.
TEST_F(ImplicitEuler, SwingsASpringAsTheFormulaDoes) {
  model::Cloth cloth = implicitCloth(calmCloth(2, 2));
  const double h = 1.0 / 72, omega = 3 / h;
  cloth.structural = {static_cast<float>(0.01 * omega * omega), 0};
  cloth.shear = cloth.bend = {};
  cloth.damping = 0;
  cloth.pins = {topRow(cloth)};
  cloth.solver.tolerance = 1e-6f;
  model::Scene scene = steps({cloth}, 72);
  scene.environment.gravity = model::Vec3::Zero();
  Running running(scene);
  NodeState state = simulation::restState(scene.cloths);
  double x = 0.0015, v = 0;
  for (const std::size_t node : {2, 3}) state.positions[node].y() -= static_cast<float>(x);
  running.restore(state);
  // Rounding of 2 cm is 1e-9 m. In every step h omega^2 turns it into a speed, which decays by a third.
  const double rounding = 0.02 * kRounding * 4, tolerance = 2 * rounding * omega * omega * h;
  for (int step = 0; step < 8; ++step) {
    running.tick(inputsOf(scene));
    v = (v - h * omega * omega * x) / (1 + h * h * omega * omega);
    x += h * v;
    state = running.state();
    for (const std::size_t node : {2, 3}) {
      EXPECT_NEAR(-0.02 - state.positions[node].y(), x, h * tolerance) << step;
      EXPECT_NEAR(-state.velocities[node].y(), v, tolerance) << step;
    }
  }
}

// When the cloth has come to rest, the springs carry the weight, for every length of the step.
TEST_F(ImplicitEuler, HangsWhereForcesBalance) {
  model::Cloth cloth = stiffCloth(12, 12);
  cloth.pins = {topRow(cloth)};
  cloth.damping = 2;
  const model::Scene scene = steps({cloth}, 30);
  EXPECT_EQ(model::stableSubsteps(scene), 1u);
  Running running(scene);
  for (int tick = 0; tick < 300; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene)).healthy) << tick;
  reference::ReferenceSimulation reference(scene);
  setState(reference, running.state());
  reference::ReferenceCloth& hung = reference.cloths().front();
  std::vector<reference::Vec3> forces(hung.nodeCount(), reference::Vec3::Zero());
  hung.accumulateSpringForces(forces);
  double most = 0;
  for (std::uint32_t i = 0; i < hung.nodeCount(); ++i)
    if (hung.inverseMasses()[i] > 0)
      most = std::max(most, (forces[i] * hung.inverseMasses()[i] + reference::Vec3(0, -9.81, 0)).norm());
  EXPECT_LT(most, 0.01 * 9.81);
  EXPECT_GT(hung.strain().max, 0.001);  // the springs are stretched
}

// A correction acts on both ends of a spring with opposite sign. Only the rounding of sums and the residual
// of the solve remain.
TEST_F(ImplicitEuler, KeepsAFreeClothsMomentum) {
  model::Cloth cloth = stiffCloth(20, 20);
  cloth.damping = 0;
  cloth.solver.tolerance = 1e-6f;
  cloth.solver.iterations = 500;
  model::Scene scene = steps({cloth}, 72);
  scene.environment.gravity = model::Vec3::Zero();
  std::mt19937 random(7);
  const NodeState start = randomState(scene, random, 0.001f, 0.5f);
  const auto momentum = [](const NodeState& state) {
    reference::Vec3 sum = reference::Vec3::Zero();
    for (const model::Vec3& v : state.velocities) sum += v.cast<double>();
    return sum;
  };
  Running running(scene);
  running.restore(start);
  for (int tick = 0; tick < 20; ++tick) running.tick(inputsOf(scene));
  double flow = 0;
  for (const model::Vec3& v : start.velocities) flow += v.norm();
  // A free velocity is (h^2 k / m) times the springs' stretch over h, a hundred times the resulting velocity.
  // It is a sum of twelve forces, and each of them rounds it once.
  EXPECT_LT((momentum(running.state()) - momentum(start)).norm(), 20 * 12 * 100 * kRounding * flow);
}

TEST_F(ImplicitEuler, HoldsASheetWhereMassSpringDiverges) {
  for (const model::SolverKind solver : {model::SolverKind::massSpring, model::SolverKind::implicitEuler}) {
    model::Cloth cloth = stiffCloth(16, 16);
    cloth.solver.kind = solver;
    cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = 15, .columnStep = 15}};
    const model::Scene scene = steps({cloth}, 60);
    const simulation::MovingCollider ball{
        model::Sphere{0.06f}, {model::Vec3(0, -0.2f, 0.05f)}, {model::Vec3(0, -0.2f, 0.05f)}, 1};
    Running running(scene);
    bool healthy = true;
    for (int tick = 0; tick < 180 && healthy; ++tick) healthy = running.tick(inputsOf(scene, {ball})).healthy;
    EXPECT_EQ(healthy, solver == model::SolverKind::implicitEuler);
    if (!healthy) continue;
    const double distance = 0.06 + double{cloth.thickness};
    for (const model::Vec3& p : running.state().positions)
      EXPECT_GT((p - ball.start.position).cast<double>().norm(), distance * (1 - 1e-5));
  }
}

// The cloth is too stiff for so few iterations. Its motion lags but stays bounded.
TEST_F(ImplicitEuler, StaysCalmIfTheSolveEndsEarly) {
  model::Cloth cloth = stiffCloth(24, 24);
  cloth.structural.stiffness = 4000;
  cloth.pins = {topRow(cloth)};
  cloth.solver.iterations = 4;
  cloth.solver.tolerance = 0;
  const model::Scene scene = steps({cloth}, 72);
  Running running(scene);
  for (int tick = 0; tick < 216; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene)).healthy) << tick;
  reference::ReferenceSimulation reference(scene);
  setState(reference, running.state());
  // The cloth cannot gain more than its potential energy at the start, which is at most that of its whole
  // height.
  const reference::ReferenceCloth& hung = reference.cloths().front();
  EXPECT_LT(hung.kineticEnergy(), 0.01 * 576 * 9.81 * 0.46);
}

TEST_F(ImplicitEuler, WorksInASceneWithEveryOtherSolver) {
  model::Cloth free = calmCloth(9, 14), held = calmCloth(7, 8), implicit = stiffCloth(8, 6);
  model::Cloth disc = implicitCloth(discCloth(4));
  free.pins = {topRow(free)};
  held.solver.kind = model::SolverKind::constraint;
  held.name = "held";
  implicit.name = "implicit";
  disc.name = "disc";
  const model::Scene together = sceneOf({held, implicit, free, disc});
  Running all(together);
  for (int tick = 0; tick < 20; ++tick) EXPECT_TRUE(all.tick(inputsOf(together)).healthy);
  std::size_t first = 0;
  const NodeState found = all.state();
  for (const model::Cloth& cloth : together.cloths) {
    SCOPED_TRACE(cloth.name);
    const model::Scene alone = sceneOf({cloth});
    Running one(alone);
    for (int tick = 0; tick < 20; ++tick) one.tick(inputsOf(alone));
    const NodeState expected = one.state();
    for (std::size_t i = 0; i < expected.positions.size(); ++i)
      EXPECT_EQ(expected.positions[i], found.positions[first + i]) << i;
    first += expected.positions.size();
  }
}

}  // namespace
}  // namespace clothstream::tests
