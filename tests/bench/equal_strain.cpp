// SPDX-License-Identifier: MIT
// Suite equal_strain: cost of a node and frame with the cheapest setting of each solver that keeps a sheet's
// strain below a bound.
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/model/coarse_level.h"
#include "server/reference/reference_cloth.h"
#include "server/simulation/software_threads.h"
#include "tests/bench/hung_cloth.h"
#include "tests/bench/reference_check.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

// Mean strains of the same sheets with NvCloth's CPU solver, 5 iterations a frame.
struct Bound {
  std::uint32_t size;
  double strain;
};
constexpr Bound kBounds[] = {{32, 0.008}, {64, 0.026}, {128, 0.041}, {256, 0.053}};

// Energy in J that gravity must have lost by then: 90 % of that of a hanging sheet. A solve that ends early
// holds a sheet together by hardly letting it fall.
constexpr float kMass = 0.2f;
constexpr double kFallen = 0.9 * double{kMass} * 9.81 * 0.5;

constexpr std::uint32_t kFramesPerSecond = 60, kFrames = 3 * kFramesPerSecond;

struct Setting {
  std::uint32_t substeps, iterations;
  std::optional<model::CoarseCorrection> coarse = {};
};

// Ordered from cheap to expensive.
struct Ladder {
  const char* method;
  model::SolverKind kind;
  // maximum rows; where one workgroup solves a cloth, software devices take minutes for more
  std::uint32_t largest;
  std::vector<Setting> settings;
  bool tethers = false;
};

std::vector<Ladder> ladders() {
  using enum model::SolverKind;
  return {
      {"mass_spring",
       massSpring,
       256,
       {{8, 0},
        {10, 0},
        {12, 0},
        {14, 0},
        {16, 0},
        {20, 0},
        {24, 0},
        {28, 0},
        {32, 0},
        {40, 0},
        {48, 0},
        {64, 0},
        {96, 0}}},
      {"xpbd",
       xpbd,
       256,
       {{2, 1}, {3, 1}, {4, 1}, {5, 1}, {6, 1}, {7, 1}, {8, 1}, {10, 1}, {12, 1}, {16, 1}, {24, 1}}},
      {"mass_spring_tethered",
       massSpring,
       256,
       {{3, 0}, {4, 0}, {5, 0}, {6, 0}, {7, 0}, {8, 0}, {10, 0}, {12, 0}, {16, 0}, {24, 0}, {32, 0}, {48, 0}},
       true},
      {"mass_spring_coarse",
       massSpring,
       256,
       {{3, 0, {{4, 6, 2}}},
        {4, 0, {{4, 4, 2}}},
        {4, 0, {{8, 6, 2}}},
        {4, 0, {{16, 6, 2}}},
        {6, 0, {{16, 6, 2}}},
        {8, 0, {{16, 8, 2}}}}},
      {"implicit_euler", implicitEuler, 64, {{1, 3}, {1, 5}, {1, 8}, {1, 12}, {1, 20}, {1, 40}, {1, 80}}},
      {"constraint", constraint, 32, {{1, 20}, {2, 20}, {4, 20}}}};
}

model::Scene sceneOf(const Ladder& ladder, const Setting& setting, std::uint32_t size) {
  model::Solver solver;
  solver.kind = ladder.kind;
  solver.iterations = std::max(1u, setting.iterations);
  model::Scene scene = swingingSheet(size, solver, setting.substeps);
  model::Cloth& cloth = scene.cloths.front();
  if (ladder.tethers) cloth.tethers = model::Tethers{};
  // Forces are as stiff as the step allows: 8 (0.36 + 0.08 + 0.04) k h^2 / m = 3.84 of 4, with k = m / h^2.
  // The other solvers have the stiffness of cloth.
  const double h = scene.substepSeconds();
  const double bearable = double{cloth.nodeMass()} / (h * h);
  const bool forces = ladder.kind == model::SolverKind::massSpring;
  cloth.structural.stiffness = forces ? static_cast<float>(0.36 * bearable) : 1500.0f;
  cloth.shear.stiffness = forces ? static_cast<float>(0.08 * bearable) : 60.0f;
  cloth.bend.stiffness = static_cast<float>(0.04 * bearable);
  cloth.coarse = setting.coarse;
  if (cloth.coarse) {
    // The damping that a coarse correction needs takes 0.8 of the 4.
    cloth.structural.damping = 1.001f * model::leastCoarseDamping(cloth, h);
    cloth.structural.stiffness *= 0.79f;
  }
  return scene;
}

// Energy lost since the start, in J.
double gravityEnergyLost(const model::Scene& scene, const reference::ReferenceCloth& measured) {
  const reference::Vec3 gravity = scene.environment.gravity.cast<double>();
  return reference::ReferenceCloth(scene.cloths.front()).gravityEnergy(gravity) -
         measured.gravityEnergy(gravity);
}

Row rowOf(const Ladder& ladder, const Setting& setting, const Bound& bound, const model::Scene& scene,
          const reference::ReferenceCloth& measured, const Simulated& simulated) {
  const double nodes = scene.nodeCount();
  return {{"suite", "equal_strain"},
          {"nodes", scene.nodeCount()},
          {"bound", bound.strain},
          {"method", ladder.method},
          {"substeps", setting.substeps},
          {"iterations", setting.iterations},
          {"nsPerNodeFrame", simulated.wall().median() / nodes * 1e9},
          {"nsPerNodeFrameMin", simulated.wall().min() / nodes * 1e9},
          {"strainMean", measured.strain().mean},
          {"strainP99", measured.strain().p99},
          {"cells", setting.coarse ? setting.coarse->cells : 0},
          {"sweeps", setting.coarse ? setting.coarse->sweeps : 0},
          {"every", setting.coarse ? setting.coarse->every : 0},
          {"kineticEnergy", measured.kineticEnergy()},
          {"elasticEnergy", measured.elasticEnergy()},
          {"gravityEnergyLost", gravityEnergyLost(scene, measured)}};
}

// First setting of the ladder with which the sheet falls and keeps the bound. Otherwise nullopt.
std::optional<Row> cheapest(vulkan::Device& device, const Settings& settings, const Ladder& ladder,
                            const Bound& bound) {
  for (const Setting& setting : ladder.settings) {
    const model::Scene scene = sceneOf(ladder, setting, bound.size);
    const simulation::TickInputs inputs{scene.environment, {}};
    const simulation::SimulationOptions options{.rowsPerInvocation = settings.rowsPerInvocation,
                                                .workgroupSize = settings.workgroupSize,
                                                .xpbdWholeNodes = settings.xpbdWholeNodes};
    checkWithReference(device, scene, options);
    Simulated simulated(device, scene, options);
    for (std::uint32_t frame = 0; frame < kFrames; ++frame) simulated.tick(inputs);
    const reference::ReferenceCloth measured = measuredCloth(scene.cloths.front(), simulated.state());
    if (measured.strain().mean > bound.strain || gravityEnergyLost(scene, measured) < kFallen) continue;
    Row row = rowOf(ladder, setting, bound, scene, measured, simulated);
    row["device"] = device.info().name;
    return row;
  }
  return std::nullopt;
}

}  // namespace

// Runs each size on a device that the server would choose for it.
void runEqualStrain(vulkan::Device&, const Settings& settings, const RowSink& add) {
  bool known = false;
  for (const Bound& bound : kBounds) {
    if (settings.size && *settings.size != bound.size) continue;
    vulkan::Device device(simulation::suitedTo(bound.size * bound.size, settings.device));
    known = true;
    bool found = false;
    for (const Ladder& ladder : ladders())
      if (bound.size <= ladder.largest)
        if (const auto row = cheapest(device, settings, ladder, bound)) {
          add(*row);
          found = true;
        }
    if (!found)
      throw std::runtime_error(
          fmt::format("{} nodes a side: every setting stretches by more than {}", bound.size, bound.strain));
  }
  if (!known) throw std::runtime_error("--size: use 32, 64, 128 or 256");
}

}  // namespace clothstream::bench
