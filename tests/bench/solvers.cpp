// SPDX-License-Identifier: MIT
// Suite solvers: the same hanging sheet by every solver, with cost of a substep and strain.
#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/hung_cloth.h"
#include "tests/bench/reference_check.h"
#include "tests/bench/simulated.h"
#include "tests/bench/strain.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kTicks = 72;  // one second

struct Case {
  const char* method;
  model::SolverKind kind;
  std::uint32_t substeps = 10;
  float stiffness = 0;  // N/m; 0: as stiff as a force may be
  std::uint32_t sweeps = 1;
  std::optional<float> compliance = {};
};

// XPBD and implicit Euler have the stiffness of cloth that hardly stretches under its own weight.
constexpr Case kCases[] = {{"mass_spring", model::SolverKind::massSpring},
                           {"acad", model::SolverKind::acad},
                           {"constraint", model::SolverKind::constraint},
                           {"implicit_euler", model::SolverKind::implicitEuler, 10, 1000},
                           {"implicit_euler", model::SolverKind::implicitEuler, 2, 1000},
                           {"xpbd", model::SolverKind::xpbd, 10, 1000},
                           {"xpbd, 4 sweeps", model::SolverKind::xpbd, 10, 1000, 4},
                           {"xpbd", model::SolverKind::xpbd, 40, 1000},
                           {"xpbd, compliance 0", model::SolverKind::xpbd, 40, 0, 1, 0.0f}};

// A square metre of 0.2 kg, hung by its upper edge.
model::Scene sceneOf(const Case& experiment, std::uint32_t size) {
  model::Solver solver{.kind = experiment.kind, .compliance = experiment.compliance};
  if (experiment.kind == model::SolverKind::xpbd) solver.iterations = experiment.sweeps;
  model::Scene scene = hungSheet(size, solver, experiment.substeps);
  model::Cloth& cloth = scene.cloths.front();
  // 2 (4 + 4 / 2 + 4 / 10) k h^2 / m = 3.2 of the 4 that a step allows.
  const double h = scene.substepSeconds();
  const auto bearable = static_cast<float>(0.25 * double{cloth.nodeMass()} / (h * h));
  const float stiffness = experiment.stiffness > 0 ? experiment.stiffness : bearable;
  cloth.structural.stiffness = stiffness;
  cloth.shear.stiffness = stiffness / 2;
  cloth.bend.stiffness = bearable / 10;
  return scene;
}

// Maximum strain of a structural spring. For XPBD: twice what its stiffness and its neighbours' corrections
// in a substep allow (docs/simulation.md), because of the fall. For constraints and implicit forces: 1, so
// that they hold at all. Explicit forces have no bound, since their strain is the result of the row.
double mostStrain(const model::Scene& scene) {
  const model::Cloth& cloth = scene.cloths.front();
  if (cloth.solver.kind == model::SolverKind::massSpring) return std::numeric_limits<double>::max();
  if (cloth.solver.kind != model::SolverKind::xpbd) return 1;
  const double rows = cloth.grid.rows, length = double{cloth.grid.height} / (rows - 1),
               h = scene.substepSeconds();
  const double compliance =
      cloth.solver.compliance ? double{*cloth.solver.compliance} : 1 / double{cloth.structural.stiffness};
  return 2 * rows * 9.81 * (double{cloth.nodeMass()} * compliance + 2 * h * h) / length;
}

Row measure(vulkan::Device& device, const Settings& settings, const Case& experiment, std::uint32_t size) {
  const model::Scene scene = sceneOf(experiment, size);
  const simulation::TickInputs inputs{scene.environment, {}};
  const simulation::SimulationOptions options{.rowsPerInvocation = settings.rowsPerInvocation,
                                              .workgroupSize = settings.workgroupSize,
                                              .xpbdWholeNodes = settings.xpbdWholeNodes,
                                              .solveWholeNodes = settings.solveWholeNodes};
  checkWithReference(device, sceneOf(experiment, std::min(size, 32u)), options);
  Simulated simulated(device, scene, options);
  for (std::uint32_t tick = 0; tick < kTicks; ++tick) simulated.tick(inputs);
  const Samples strains = structuralStrains(scene.cloths.front(), simulated.state());
  if (!(strains.quantile(1) <= mostStrain(scene)))
    throw std::runtime_error(fmt::format("{}, {} nodes a side: a spring stretches by {}", experiment.method,
                                         size, strains.quantile(1)));
  const auto substeps = static_cast<double>(std::uint64_t{scene.nodeCount()} * scene.substeps);
  return {{"suite", "solvers"},
          {"method", experiment.method},
          {"nodes", scene.nodeCount()},
          {"substeps", scene.substeps},
          {"stiffness", scene.cloths.front().structural.stiffness},
          {"nsPerNodeSubstep", simulated.wall().median() / substeps * 1e9},
          {"nsPerNodeSubstepMin", simulated.wall().min() / substeps * 1e9},
          {"strainMean", strains.mean()},
          {"strainP99", strains.p99()},
          {"strainMax", strains.quantile(1)},
          {"device", device.info().name}};
}

}  // namespace

void runSolvers(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  for (const std::uint32_t size : settings.size ? std::vector{*settings.size} : std::vector{32u, 64u})
    for (const Case& experiment : kCases) add(measure(device, settings, experiment, size));
}

}  // namespace clothstream::bench
