// SPDX-License-Identifier: MIT
// Suite acad: adaptive constraints with 0, 1, 5 and 20 % of the springs as constraints, compared with
// mass-spring and with full constraint enforcement of the same cloth. With a coarse correction fewer springs
// are stretched.
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "server/model/coarse_level.h"
#include "server/model/springs.h"
#include "server/model/strain_limit.h"
#include "tests/bench/bytes_moved.h"
#include "tests/bench/reference_check.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

// Texels that must move for a node and substep. A mass-spring step reads two and writes two. The check reads
// one. A node of a chunk with constraints is prepared (four read, four written), iterated as in suite
// enforcement, and corrected (three read, two written). A copy reads one and writes one.
constexpr double kForces = 4, kCheck = 1, kPrepared = 8 + 5, kIteration = 14, kTexelsOfACopy = 2;
constexpr std::uint32_t kTicks = 40;
// Rows of the largest sheet that is compared with the reference. Several workgroups solve it.
constexpr std::uint32_t kLargestCompared = 128;

// A sheet that hangs at rest by its upper edge, as stiff as its substeps allow. Gravity is so strong that its
// uppermost rows would be stretched beyond 10 %. A quarter of their springs are vertical, and all of these
// are stretched.
struct Case {
  std::string method;
  model::SolverKind kind;
  double active = 0;  // part of the springs that are constraints
  model::AcadMode mode = model::AcadMode::limit;
  bool coarse = false;  // with a coarse correction
};

constexpr float kMass = 0.2f, kActivation = 0.1f;

model::Scene sceneOf(const Case& experiment, std::uint32_t size) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.mass = kMass;
  cloth.damping = 1;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = size - 1}};
  cloth.solver.kind = experiment.kind;
  cloth.solver.activation = kActivation;
  cloth.solver.acadMode = experiment.mode;
  model::Scene scene;
  const double h = scene.substepSeconds();
  cloth.structural.stiffness = static_cast<float>(0.25 * double{cloth.nodeMass()} / (h * h));
  cloth.shear.stiffness = 0.01f * cloth.structural.stiffness;
  if (experiment.coarse) {
    cloth.structural.damping = 1.001f * model::leastCoarseDamping(cloth, h);
    cloth.coarse = model::CoarseCorrection{.cells = 8, .sweeps = 6, .every = 2};
  }
  // (N - i) nodes hang below row i of N in a column: k strain L = (N - i) m g.
  const double rows = 4 * experiment.active, length = 1.0 / (size - 1);
  const double held = double{model::heldStrain(cloth.solver)};
  const double most = experiment.active == 0 ? 0.5 * held : held / (1 - rows);
  scene.environment.gravity = model::Vec3(
      0, -static_cast<float>(most * double{cloth.structural.stiffness} * length * size / double{kMass}), 0);
  scene.name = "acad";
  scene.cloths = {cloth};
  return scene;
}

// Rows where they hang at rest. With ACAD those beyond the bound hang at `times` the strain that it holds.
simulation::NodeState hanging(const model::Scene& scene, double times = 1) {
  const model::Cloth& cloth = scene.cloths.front();
  const double held = times * double{model::heldStrain(cloth.solver)};
  const model::Grid& grid = cloth.grid;
  simulation::NodeState state = simulation::restState(scene.cloths);
  const double length = double{model::spacing(grid).row};
  const double weight = -double{cloth.nodeMass()} * double{scene.environment.gravity.y()};
  double y = 0;
  for (std::uint32_t row = 1; row < grid.rows; ++row) {
    const double strain = (grid.rows - row) * weight / (double{cloth.structural.stiffness} * length);
    y += length * (1 + std::min(strain, cloth.solver.kind == model::SolverKind::acad ? held : strain));
    for (std::uint32_t column = 0; column < grid.columns; ++column)
      state.positions[row * grid.columns + column].y() = static_cast<float>(-y);
  }
  return state;
}

// Compares with the reference: from a displaced state, and from the state that is measured. There the rows
// that constraints hold hang a little beyond the bound, where rounding cannot decide whether they are
// constraints.
void check(vulkan::Device& device, const Case& experiment, std::uint32_t size,
           const simulation::SimulationOptions& options) {
  const model::Scene scene = sceneOf(experiment, size);
  checkWithReference(device, scene, options);
  checkWithReference(device, scene, options, hanging(scene, 1.2), {scene.environment, {}});
}

struct Candidate {
  Case experiment;
  model::Scene scene;
  std::unique_ptr<Simulated> simulated;
  Samples constraints = {}, iterations = {};
};

Rows measureSize(vulkan::Device& device, const Settings& settings, std::uint32_t size) {
  using enum model::SolverKind;
  const simulation::SimulationOptions options{.rowsPerInvocation = settings.rowsPerInvocation,
                                              .workgroupSize = settings.workgroupSize,
                                              .solveWholeNodes = settings.solveWholeNodes};
  std::vector<Candidate> candidates;
  for (const Case& experiment :
       {Case{"mass_spring", massSpring}, Case{"acad", acad, 0}, Case{"acad", acad, 0.01},
        Case{"acad", acad, 0.05}, Case{"acad", acad, 0.2},
        Case{"acad_paper", acad, 0, model::AcadMode::paper},
        Case{"mass_spring", massSpring, 0, model::AcadMode::limit, true},
        Case{"acad", acad, 0.05, model::AcadMode::limit, true}, Case{"constraint", constraint}}) {
    Candidate candidate{experiment, sceneOf(experiment, size), nullptr};
    check(device, experiment, std::min(size, kLargestCompared), options);
    candidate.simulated = std::make_unique<Simulated>(device, candidate.scene, options);
    candidate.simulated->restart(hanging(candidate.scene));
    candidates.push_back(std::move(candidate));
  }
  // Candidates alternate, so that disturbances of the machine affect all of them alike. Rows have minima.
  for (std::uint32_t tick = 0; tick < kTicks; ++tick)
    for (Candidate& candidate : candidates) {
      candidate.simulated->tick({candidate.scene.environment, {}});
      for (const shared::SolveRecord& solve : candidate.simulated->solves()) {
        candidate.constraints.add(solve.constraints);
        candidate.iterations.add(solve.iterations);
      }
    }
  const double copy = secondsToCopyTexels(device, std::size_t{size} * size) / kTexelsOfACopy;
  const double forces = candidates.front().simulated->wall().min();
  const double full = candidates.back().simulated->wall().min();
  Rows rows;
  for (const Candidate& candidate : candidates) {
    const model::Scene& scene = candidate.scene;
    const double substeps = static_cast<double>(std::uint64_t{scene.nodeCount()} * scene.substeps);
    const double seconds = candidate.simulated->wall().min();
    nlohmann::ordered_json row{{"suite", "acad"},
                               {"method", candidate.experiment.method},
                               {"coarse", candidate.experiment.coarse},
                               {"nodes", scene.nodeCount()},
                               {"nsPerNodeSubstep", seconds / substeps * 1e9},
                               {"timesMassSpring", seconds / forces},
                               {"timesFasterThanConstraint", full / seconds}};
    if (candidate.experiment.kind == acad) {
      double springs = 0;
      for (const model::SpringLink& link : model::springLinks(scene.cloths.front()))
        springs += model::isConstraint(scene.cloths.front().solver, link.kind) ? 1 : 0;
      const double active = candidate.constraints.mean() / springs, wanted = candidate.experiment.active;
      // Rows become active as a whole: of 64 rows 1 % of the springs are two or three.
      const double ofRow = wanted > 0 ? static_cast<double>(size) / springs : 0;
      const bool fits =
          candidate.experiment.coarse || (active >= 0.5 * wanted - ofRow && active <= 2 * wanted + ofRow);
      if (!fits)
        throw std::runtime_error(
            fmt::format("{} of the springs are constraints where {} should be", active, wanted));
      // Active springs are the vertical ones of whole rows.
      const double nodes = std::min(1.0, 4 * active);
      const double floor =
          copy * (kForces + kCheck + nodes * (kPrepared + kIteration * candidate.iterations.mean()));
      row["active"] = active;
      row["iterations"] = candidate.iterations.mean();
      row["floorNs"] = floor / scene.nodeCount() * 1e9;
      row["timesFloor"] = seconds / scene.substeps / floor;
      row["nsBeyondMassSpring"] = (seconds - forces) / substeps * 1e9;
    }
    row["ticks"] = candidate.simulated->wall().count();
    row["device"] = device.info().name;
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

void runAcad(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  for (const std::uint32_t size : settings.size ? std::vector{*settings.size} : std::vector{64u, 128u})
    for (const Row& row : measureSize(device, settings, size)) add(row);
}

}  // namespace clothstream::bench
