// SPDX-License-Identifier: MIT
#include "tests/bench/hung_cloth.h"

#include <cmath>
#include <optional>
#include <vector>

#include "server/model/springs.h"
#include "tests/bench/simulated.h"

namespace clothstream::bench {
namespace {

// Reduces a sheet to one substep that is solved to the end. Returns the allowed distance of nodes from the
// reference in metres.
double solveToTheEnd(model::Scene& sheet) {
  sheet.simulationRate *= sheet.substeps;
  sheet.streamRate = sheet.simulationRate;
  sheet.substeps = 1;
  model::Cloth& cloth = sheet.cloths.front();
  model::Solver& solver = cloth.solver;
  if (solver.kind == model::SolverKind::xpbd) {
    // A correction rounds both ends to half of 2^-24 m on each axis and computes a length of at most a tenth
    // of a metre with a relative error of 1e-6: 3e-7 m in all. A sweep corrects a node twelve times, and
    // reduces the errors that it finds.
    return solver.iterations * 12 * 3e-7;
  }
  solver.iterations = 2000;
  const double spacing = model::spacing(cloth.grid).column;
  if (solver.kind == model::SolverKind::implicitEuler) {
    // With A = M + h^2 K, preconditioned by its diagonal D, the error of the velocities is at most
    // sqrt(D / m) tolerance |rho| / m, where rho = h K x is the remainder at the start and x the
    // displacement. Twelve springs of a node give D <= m + 24 h^2 k and |K x| <= 24 k |x|.
    solver.tolerance = 1e-6f;
    const double h = sheet.substepSeconds();
    const double springs = 24 * h * h * double{cloth.structural.stiffness} / double{cloth.nodeMass()};
    const double displaced = std::sqrt(static_cast<double>(cloth.nodeCount())) * 0.35 * spacing;
    return std::sqrt(1 + springs) * double{solver.tolerance} * springs * displaced;
  }
  // With A = c M + J^T J of the solved system, c M 0.01 of it, and rho = A e the remainder, |e| <= 100 |rho|.
  // |rho| is the tolerance times |J^T b| <= 5 |b|, and |b| is the displacement of the ends of all links.
  solver.tolerance = 1e-5f;
  const double displaced = std::sqrt(static_cast<double>(model::springLinks(cloth).size())) * 0.4 * spacing;
  return 500 * double{solver.tolerance} * displaced;
}

}  // namespace

model::Scene hungCloth(std::uint32_t size) {
  model::Cloth cloth;
  cloth.name = "hung";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = 2;
  cloth.mass = 1;
  cloth.structural = {30, 0.02f};
  cloth.shear = {15, 0.01f};
  cloth.bend = {2, 0.002f};
  cloth.damping = 0.4f;
  cloth.drag = 0.5f;
  cloth.lift = 0.3f;
  cloth.pins = {
      {.firstRow = 0, .lastRow = 0, .rowStep = 1, .firstColumn = 0, .lastColumn = size - 1, .columnStep = 3}};
  model::Scene scene;
  scene.name = "hung_cloth";
  scene.environment.wind = model::Vec3(0, 0, 2);
  scene.cloths = {cloth};
  return scene;
}

simulation::TickInputs hungClothInputs(const model::Scene& scene, std::uint64_t tick) {
  const auto centre = [&](std::uint64_t at) {
    const double seconds = static_cast<double>(at) * scene.tickSeconds();
    return model::Vec3(0, -1.2f, static_cast<float>(0.6 * std::cos(2 * seconds)));
  };
  return {scene.environment, {{model::Sphere{0.25f}, {centre(tick)}, {centre(tick + 1)}, 1}}};
}

model::Scene hungSheet(std::uint32_t size, const model::Solver& solver, std::uint32_t substeps) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 0.2f;
  cloth.damping = 1;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = size - 1}};
  cloth.solver = solver;
  model::Scene scene;
  scene.name = "hung_sheet";
  scene.substeps = substeps;
  scene.cloths = {cloth};
  return scene;
}

std::uint32_t checkWithReference(vulkan::Device& device, model::Scene sheet,
                                 const simulation::SimulationOptions& options) {
  const bool isSolved = sheet.cloths.front().solver.kind != model::SolverKind::massSpring;
  const std::optional<double> allowed = isSolved ? std::optional(solveToTheEnd(sheet)) : std::nullopt;
  Simulated simulated(device, sheet, options);
  const simulation::TickInputs inputs{sheet.environment, {}};
  allowed ? simulated.check(inputs, *allowed) : simulated.check(inputs);
  const std::vector<shared::SolveRecord> solves = simulated.solves();
  return solves.empty() ? 0 : solves.front().iterations;
}

}  // namespace clothstream::bench
