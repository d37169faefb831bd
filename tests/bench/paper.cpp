// SPDX-License-Identifier: MIT
// Suite paper: Figures 7 to 10 of [Va21] at the paper's sizes. Our frame is one step of its time step,
// without rendering. The paper's frame is a rendered frame of a Unity scene (docs/benchmarks.md).
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include "server/model/springs.h"
#include "tests/bench/simulated.h"
#include "tests/bench/strain.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

// The paper's step is 0.005 s. It gives neither masses nor lengths; these are stable with its largest
// stiffness.
constexpr std::uint32_t kStepsPerSecond = 200;
constexpr float kSpacing = 0.1f, kNodeMass = 0.1f, kStiffness = 200, kDamping = 0.1f;
// The paper averages over 500 frames.
constexpr std::size_t kFrames = 500;
// Largest relative residual of a row that counts as converged.
constexpr float kConverged = 0.01f;

struct Case {
  int figure;
  const char* method;
  std::uint32_t rows, columns;
  double paperFramesPerSecond;
  model::Solver solver = {};
};

model::Solver constraints(bool bend, std::optional<float> compliance) {
  return {.kind = model::SolverKind::constraint,
          .bendConstraints = bend,
          .compliance = compliance,
          .iterations = 1000,
          .tolerance = kConverged};
}

std::vector<Case> cases() {
  model::Solver acad = constraints(true, {});
  acad.kind = model::SolverKind::acad;
  acad.iterations = 100;
  return {{7, "mass_spring", 96, 96, 200},
          {7, "mass_spring", 256, 256, 200},
          {8, "mass_spring", 5717, 1368, 34.81},
          {9, "constraint", 32, 32, 66.06, constraints(false, 0.0f)},
          {9, "constraint", 38, 38, 44.25, constraints(false, 0.0f)},
          {9, "constraint", 34, 34, 31.95, constraints(true, 0.0f)},
          {9, "constraint", 32, 32, 66.06, constraints(false, {})},
          {9, "constraint", 38, 38, 44.25, constraints(false, {})},
          {9, "constraint", 34, 34, 31.95, constraints(true, {})},
          {10, "mass_spring", 32, 32, 222.46},
          {10, "acad", 32, 32, 206.44, acad}};
}

model::Scene sceneOf(const Case& experiment) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = experiment.rows,
                .columns = experiment.columns,
                .width = kSpacing * static_cast<float>(experiment.columns - 1),
                .height = kSpacing * static_cast<float>(experiment.rows - 1),
                .pose = {}};
  cloth.mass = kNodeMass * static_cast<float>(cloth.grid.nodeCount());
  cloth.structural = cloth.shear = cloth.bend = {kStiffness, kDamping};
  cloth.damping = 0.5f;
  cloth.pins = {{.firstRow = 0,
                 .lastRow = 0,
                 .firstColumn = 0,
                 .lastColumn = experiment.columns - 1,
                 .columnStep = experiment.columns - 1}};
  cloth.solver = experiment.solver;
  model::Scene scene;
  scene.name = "paper";
  scene.simulationRate = scene.streamRate = kStepsPerSecond;
  scene.substeps = 1;
  scene.cloths = {cloth};
  return scene;
}

// Compares with the reference, with a solve tight enough to compare. With the default compliance, nodes are
// off by at most 500 times the tolerance times the constraints' demand (tests/simulation derives it).
void check(vulkan::Device& device, model::Scene scene, std::size_t links,
           const simulation::TickInputs& inputs) {
  model::Solver& solver = scene.cloths.front().solver;
  if (solver.kind == model::SolverKind::massSpring) {
    Simulated(device, scene, {}).check(inputs);
    return;
  }
  solver.compliance.reset();
  solver.iterations = 5000;
  solver.tolerance = 2e-6f;
  const double side = std::sqrt(static_cast<double>(links)) * 0.4 * kSpacing;
  Simulated(device, scene, {}).check(inputs, 500 * double{solver.tolerance} * side);
}

Rows::value_type measure(vulkan::Device& device, const Settings& settings, const Case& experiment) {
  const model::Scene scene = sceneOf(experiment);
  const model::Cloth& cloth = scene.cloths.front();
  const std::vector<model::SpringLink> links = model::springLinks(cloth);
  const simulation::TickInputs inputs{scene.environment, {}};
  check(device, scene, links.size(), inputs);

  Simulated simulated(device, scene, {settings.rowsPerInvocation, settings.workgroupSize, {}});
  double spent = 0;
  Samples iterations, residuals;
  bool finite = true;
  while (finite && simulated.wall().count() < kFrames &&
         (spent < 10 * settings.seconds || simulated.wall().count() < 5)) {
    try {
      spent += secondsOf([&] { simulated.tick(inputs); });
    } catch (const std::runtime_error&) {
      finite = false;  // the system can be singular with compliance 0
    }
    for (const shared::SolveRecord& solve : simulated.solves()) {
      iterations.add(solve.iterations);
      residuals.add(double{solve.residual});
    }
  }
  const double seconds = simulated.wall().median();
  nlohmann::ordered_json row{
      {"suite", "paper"},
      {"figure", experiment.figure},
      {"method", experiment.method},
      {"nodes", cloth.grid.nodeCount()},
      {"springs", std::ranges::count_if(links,
                                        [&](const model::SpringLink& link) {
                                          return cloth.solver.kind != model::SolverKind::constraint ||
                                                 model::isConstraint(cloth.solver, link.kind);
                                        })},
      {"framesPerSecond", 1 / seconds},
      {"paperFramesPerSecond", experiment.paperFramesPerSecond}};
  if (iterations.count() > 0) {
    row["compliance"] = cloth.solver.compliance ? nlohmann::ordered_json(*cloth.solver.compliance)
                                                : nlohmann::ordered_json("default");
    row["iterations"] = iterations.median();
    row["residual"] = residuals.median();
    row["converged"] = finite && residuals.p99() <= double{kConverged};
  }
  row["finite"] = finite;
  if (finite) row["strainP99"] = structuralStrains(cloth, simulated.state()).p99();
  row["frames"] = simulated.wall().count();
  row["device"] = device.info().name;
  return row;
}

}  // namespace

Rows runPaper(vulkan::Device& device, const Settings& settings) {
  if (settings.size) throw std::runtime_error("--size: not allowed, because the sizes are the paper's");
  Rows rows;
  for (const Case& experiment : cases()) rows.push_back(measure(device, settings, experiment));
  return rows;
}

}  // namespace clothstream::bench
