// SPDX-License-Identifier: MIT
// Comparison of a scene on the device with the double-precision reference.
#include "tests/bench/reference_check.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/model/springs.h"
#include "server/model/strain_limit.h"
#include "server/reference/implicit_system.h"
#include "tests/bench/simulated.h"

namespace clothstream::bench {
namespace {

using model::SolverKind;
using reference::Vec3;

constexpr double kRounding = 1.0 / (1 << 24);  // half a unit in the last place, relative
constexpr double kRowRounding = 2e-6;          // relative error of a row: two reciprocal roots
// A node has at most 12 springs. The matrix J^T J of unit vectors is at most twice as large.
constexpr double kMostSprings = 12, kLargest = 2 * kMostSprings;

double norm(std::span<const Vec3> vectors) {
  double sum = 0;
  for (const Vec3& vector : vectors) sum += vector.squaredNorm();
  return std::sqrt(sum);
}

// Largest coordinate of a state, m.
double extentOf(const simulation::NodeState& state) {
  float extent = 0;
  for (const model::Vec3& position : state.positions)
    extent = std::max(extent, position.cwiseAbs().maxCoeff());
  return extent;
}

// One substep of the scene, with a solve that ends when it has converged. It has no coarse correction, which
// would act before the solve.
model::Scene solvedSubstep(model::Scene scene) {
  scene.cloths.front().coarse.reset();
  scene.simulationRate *= scene.substeps;
  scene.streamRate = scene.simulationRate;
  scene.substeps = 1;
  model::Solver& solver = scene.cloths.front().solver;
  if (solver.kind == SolverKind::xpbd) return scene;
  solver.iterations = 5000;
  solver.tolerance = 1e-5f;
  return scene;
}

// The cloth after a substep with forces alone.
reference::ReferenceCloth freeCloth(const model::Scene& scene, const simulation::NodeState& start,
                                    const model::Environment& environment) {
  model::Cloth cloth = scene.cloths.front();
  if (cloth.solver.kind == SolverKind::implicitEuler) cloth.solver.kind = SolverKind::massSpring;
  cloth.solver.iterations = 0;
  reference::ReferenceCloth free = measuredCloth(cloth, start);
  free.integrate(environment, scene.integrator, scene.substepSeconds());
  return free;
}

// A row of the system of constraints: the unit vector from a to b, and the right-hand side, m.
struct Row {
  std::uint32_t a, b;
  Vec3 direction;
  double side;
};

std::vector<Row> rowsOf(const model::Cloth& cloth, const reference::ReferenceCloth& start,
                        const reference::ReferenceCloth& free, double h) {
  const model::Solver& solver = cloth.solver;
  const double fraction = model::correctionFraction(solver);
  std::vector<Row> rows;
  for (const model::SpringLink& link : model::systemLinks(cloth)) {
    const Vec3 d = start.positions()[link.b] - start.positions()[link.a];
    const Vec3 change = h * (free.velocities()[link.b] - free.velocities()[link.a]);
    const Vec3 direction = d.normalized();
    double excess = d.norm() - double{link.restLength};
    if (model::isAcad(solver, model::AcadMode::paper)) {
      const double rest = link.restLength;
      if (d.norm() <= rest * (1 + double{solver.activation})) continue;
      excess = (d.squaredNorm() - rest * rest) / (2 * d.norm());
    } else if (solver.kind == SolverKind::acad) {
      const double longest = double{link.restLength} * (1 + double{model::heldStrain(solver)});
      if ((d + change).norm() <= longest) continue;
      excess = d.norm() - longest;
    }
    rows.push_back(
        {link.a, link.b, direction, (excess > 0 ? fraction * excess : excess) + direction.dot(change)});
  }
  return rows;
}

double norm(std::span<const Row> rows) {
  double sum = 0;
  for (const Row& row : rows) sum += row.side * row.side;
  return std::sqrt(sum);
}

// Allowed distance of all nodes together after a solved substep of constraints with the default compliance.
// Nodes solve A x = -J^T b with A = c M + J^T J, and c M = 0.01. A remaining residual rho moves them by at
// most 100 |rho|. On the device |rho| is the tolerance times |J^T b|, plus the rounding of rows, and |J^T b|
// <= 5 |b|. In the reference it is the tolerance times |b| in the multipliers, which moves nodes by at most 5
// times that. The rounding of b by that of two positions has the same factor, 1 / (2 sqrt(c M)) = 5.
Tolerance toleranceOfConstraints(const model::Scene& scene, const simulation::NodeState& start,
                                 const model::Environment& environment) {
  const model::Cloth& cloth = scene.cloths.front();
  const std::vector<Row> rows = rowsOf(cloth, measuredCloth(cloth, start),
                                       freeCloth(scene, start, environment), scene.substepSeconds());
  const double tolerance = cloth.solver.tolerance, side = norm(rows);
  const double links = static_cast<double>(model::systemLinks(cloth).size());
  const double solved = (100 * 5 * (tolerance + kRowRounding) + 5 * tolerance) * side;
  const double rounded = 5 * std::sqrt(links) * 2 * kRounding * extentOf(start);
  const double moved = std::sqrt(3.0 * cloth.nodeCount()) * 20 * kRounding * extentOf(start);
  return {.all = solved + rounded + moved};
}

// A correction rounds both ends to half of 2^-24 m on each axis and computes a length of at most a tenth of a
// metre with a relative error of 1e-6: 3e-7 m in all. A sweep corrects a node twelve times, and reduces the
// errors that it finds.
Tolerance toleranceOfSweeps(const model::Solver& solver) {
  return {.node = solver.iterations * kMostSprings * 3e-7};
}

// A residual of the device's solution in the reference's system and the allowed one, both relative to the
// residual at the start.
struct Residual {
  double found, allowed;
};

// Residual of (c M + J^T J) x = -J^T b in the norm of M^-1, which is that of the kernels. All nodes have the
// same mass. Positions are rounded where they are stored, and the free motion with its forces, some 16 times
// a velocity. Each iteration rounds the solution once.
Residual residualOfConstraints(const model::Scene& scene, const simulation::NodeState& start,
                               const simulation::NodeState& end, const shared::SolveRecord& solve,
                               const model::Environment& environment) {
  const model::Cloth& cloth = scene.cloths.front();
  const double h = scene.substepSeconds();
  const reference::ReferenceCloth started = measuredCloth(cloth, start),
                                  free = freeCloth(scene, start, environment);
  std::vector<Vec3> moves, freely, left, atStart(cloth.nodeCount(), Vec3::Zero());
  for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node) {
    moves.push_back(end.positions[node].cast<double>() - free.positions()[node]);
    freely.push_back(h * free.velocities()[node]);
    left.push_back(-model::scaledCompliance(cloth, h) * started.masses()[node] * moves.back());
  }
  for (const Row& row : rowsOf(cloth, started, free, h)) {
    const double value = row.side + row.direction.dot(moves[row.b] - moves[row.a]);
    left[row.a] += value * row.direction;
    left[row.b] -= value * row.direction;
    atStart[row.a] += row.side * row.direction;
    atStart[row.b] -= row.side * row.direction;
  }
  for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node)
    if (started.inverseMasses()[node] == 0) left[node] = atStart[node] = Vec3::Zero();
  const double side = norm(atStart);
  const double stored = std::sqrt(3.0 * cloth.nodeCount()) * kRounding * extentOf(end);
  const double rounded =
      stored + 16 * kRounding * norm(freely) + (kRowRounding + solve.iterations * kRounding) * norm(moves);
  return {norm(left) / side, double{solve.residual} + kLargest * rounded / side};
}

// Residual of (M + h D + h^2 K) (v' - v) in the norm of the inverse diagonal, which is that of the kernels.
// The solution is added to the free velocity, which can be far larger, and both are rounded. In this norm the
// matrix is at most 6 times its diagonal, because a spring has six components.
Residual residualOfForces(const model::Scene& scene, const simulation::NodeState& start,
                          const simulation::NodeState& end, const shared::SolveRecord& solve,
                          const model::Environment& environment) {
  const model::Cloth& cloth = scene.cloths.front();
  std::vector<reference::ImplicitSpring> springs;
  for (const model::SpringLink& link : model::systemLinks(cloth)) {
    const model::Spring& spring = model::springOf(cloth, link.kind);
    springs.push_back({link.a, link.b, spring.stiffness, spring.damping, link.restLength});
  }
  const reference::ReferenceCloth started = measuredCloth(cloth, start),
                                  free = freeCloth(scene, start, environment);
  const reference::ImplicitSystem system(springs, started.positions(), started.velocities(),
                                         free.velocities(), started.inverseMasses(), scene.substepSeconds());
  const auto joined = [&](const auto& valueOf) {
    Eigen::VectorXd all(system.side().size());
    for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node) all.segment<3>(3 * node) = valueOf(node);
    return all;
  };
  const Eigen::VectorXd before = joined([&](auto node) { return started.velocities()[node]; });
  const Eigen::VectorXd freely = joined([&](auto node) { return free.velocities()[node]; });
  const Eigen::VectorXd after =
      joined([&](auto node) { return end.velocities[node].template cast<double>(); });
  const Eigen::VectorXd diagonal = system.matrix().diagonal();
  const auto left = [&](const Eigen::VectorXd& velocities) {
    const Eigen::VectorXd residual = system.side() - system.matrix() * (velocities - freely);
    return std::sqrt(residual.dot(residual.cwiseQuotient(diagonal)));
  };
  const auto weighed = [&](const Eigen::VectorXd& values) {
    return std::sqrt(values.dot(values.cwiseProduct(diagonal)));
  };
  const double side = left(before);
  const double rounded = 16 * kRounding * weighed(freely) +
                         (kRowRounding + solve.iterations * kRounding) * (weighed(after) + weighed(before));
  return {left(after) / side, double{solve.residual} + 6 * rounded / side};
}

const char* nameOf(SolverKind kind) {
  switch (kind) {
    case SolverKind::massSpring:
      return "mass-spring";
    case SolverKind::constraint:
      return "constraint";
    case SolverKind::acad:
      return "acad";
    case SolverKind::implicitEuler:
      return "implicit Euler";
    case SolverKind::xpbd:
      return "xpbd";
  }
  return "";
}

// Solves on the device and compares the residual. Returns the iterations.
std::uint32_t checkResidual(vulkan::Device& device, const model::Scene& scene,
                            const simulation::SimulationOptions& options, const simulation::NodeState& start,
                            const simulation::TickInputs& inputs) {
  assert(inputs.colliders.empty());
  Simulated simulated(device, scene, options);
  simulated.restart(start);
  simulated.tick(inputs);
  const shared::SolveRecord solve = simulated.solves().front();
  const bool isImplicit = scene.cloths.front().solver.kind == SolverKind::implicitEuler;
  const Residual residual = (isImplicit ? residualOfForces : residualOfConstraints)(
      scene, start, simulated.state(), solve, inputs.environment);
  if (!(residual.found <= residual.allowed))
    throw std::runtime_error(
        fmt::format("the solution leaves a residual of {} in the reference's system; at most {} is allowed",
                    residual.found, residual.allowed));
  return solve.iterations;
}

std::uint32_t compare(vulkan::Device& device, const model::Scene& given,
                      const simulation::SimulationOptions& options, const simulation::NodeState& start,
                      const simulation::TickInputs& inputs) {
  const SolverKind kind = given.cloths.front().solver.kind;
  if (kind == SolverKind::massSpring) {
    Simulated(device, given, options).check(start, inputs, toleranceOfTick(given, start));
    return 0;
  }
  model::Scene scene = solvedSubstep(given);
  if (kind == SolverKind::implicitEuler) return checkResidual(device, scene, options, start, inputs);
  model::Solver& solver = scene.cloths.front().solver;
  Tolerance tolerance = toleranceOfSweeps(solver);
  if (kind != SolverKind::xpbd) {
    if (kind == SolverKind::constraint && solver.compliance && inputs.colliders.empty()) {
      // Without compliance a solve need not converge. It ends where the scene ends it.
      model::Scene own = scene;
      own.cloths.front().solver = given.cloths.front().solver;
      checkResidual(device, own, options, start, inputs);
    }
    solver.compliance.reset();
    if (model::isAcad(solver, model::AcadMode::paper)) {
      const double h = scene.substepSeconds();
      solver.compliance = static_cast<float>(double{model::kRelativeCompliance} * h * h /
                                             double{scene.cloths.front().nodeMass()});
    }
    tolerance = toleranceOfConstraints(scene, start, inputs.environment);
  }
  // A contact projects the end of a path on a plane, which depends on the path.
  if (!inputs.colliders.empty()) tolerance = {2 * tolerance.node, 2 * tolerance.all};
  Simulated simulated(device, scene, options);
  simulated.check(start, inputs, tolerance);
  const std::vector<shared::SolveRecord> solves = simulated.solves();
  return solves.empty() ? 0 : solves.front().iterations;
}

}  // namespace

std::uint32_t checkWithReference(vulkan::Device& device, const model::Scene& scene,
                                 const simulation::SimulationOptions& options,
                                 const simulation::NodeState& start, const simulation::TickInputs& inputs) {
  try {
    return compare(device, scene, options, start, inputs);
  } catch (const std::runtime_error& error) {
    const model::Cloth& cloth = scene.cloths.front();
    throw std::runtime_error(fmt::format("{}, {} nodes, {} substeps, compared with the reference: {}",
                                         nameOf(cloth.solver.kind), cloth.nodeCount(), scene.substeps,
                                         error.what()));
  }
}

std::uint32_t checkWithReference(vulkan::Device& device, const model::Scene& scene,
                                 const simulation::SimulationOptions& options) {
  return checkWithReference(device, scene, options, displacedState(scene), {scene.environment, {}});
}

}  // namespace clothstream::bench
