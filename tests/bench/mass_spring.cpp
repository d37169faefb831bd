// SPDX-License-Identifier: MIT
// Suite mass_spring: node-steps a second over grid sizes, compared with the device's byte floor and the
// serial reference.
#include <algorithm>
#include <memory>

#include <unistd.h>

#include "kernels/advance_mass_spring_builtin.h"
#include "tests/bench/bytes_moved.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"
#include "tests/model/meshes.h"

namespace clothstream::bench {
namespace {

// Positions and velocities, four floats each, are read and written.
constexpr double kTexelsMovedPerNodeStep = 2;
constexpr float kSpacing = 0.02f;
// Bytes a node: device memory of a ClothSimulation, and host memory of the check.
constexpr std::uint64_t kDeviceBytesPerNode = 14 * 16;
constexpr std::uint64_t kHostBytesPerNode = 400;

struct Variant {
  bool springDamping = false;
  bool air = false;
  std::uint32_t spheres = 0;
  bool builtin = false;
  bool mesh = false;  // the same cloth as a mesh
};

model::Scene squareCloth(std::uint32_t size, const Variant& variant) {
  model::Cloth cloth;
  cloth.name = "square";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = kSpacing * static_cast<float>(size - 1);
  cloth.mass = 0.01f * static_cast<float>(cloth.grid.nodeCount());
  const float damping = variant.springDamping ? 0.1f : 0.0f;
  cloth.structural = {100, damping};
  cloth.shear = {50, damping};
  cloth.bend = {10, damping};
  cloth.damping = 0.5f;
  cloth.drag = cloth.lift = variant.air ? 0.5f : 0.0f;
  cloth.pins = {{.firstRow = 0,
                 .lastRow = 0,
                 .rowStep = 1,
                 .firstColumn = 0,
                 .lastColumn = size - 1,
                 .columnStep = size - 1}};
  model::Scene scene;
  scene.name = "square";
  scene.cloths = {variant.mesh ? model::asMesh(cloth) : cloth};
  return scene;
}

simulation::TickInputs inputsOf(const model::Scene& scene, const Variant& variant) {
  simulation::TickInputs inputs{scene.environment, {}};
  // The spheres do not touch the cloth: only the search is measured, and the check stays the same.
  for (std::uint32_t i = 0; i < variant.spheres; ++i) {
    const model::Vec3 place(static_cast<float>(i), 5, 0);
    inputs.colliders.push_back({model::Sphere{0.1f}, {place}, {place}, 1});
  }
  return inputs;
}

std::uint64_t hostMemory() {
  return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

bool fits(const vulkan::Device& device, std::uint64_t size) {
  const vulkan::Limits& limits = device.limits();
  const std::uint64_t nodes = size * size;
  return nodes * 16 <= limits.maxStorageRange && nodes <= limits.maxTexelElements &&
         nodes * kDeviceBytesPerNode <= limits.deviceMemoryBytes / 10 * 9 &&
         nodes * kHostBytesPerNode <= hostMemory() / 4 * 3;
}

struct Candidate {
  Variant variant;
  model::Scene scene;
  simulation::TickInputs inputs;
  std::unique_ptr<Simulated> simulated;
  double referenceSeconds = 0;
};

// All variants of one size alternate, so that disturbances of the machine affect them alike.
Rows measureSize(vulkan::Device& device, const Settings& settings, std::uint32_t size,
                 const std::vector<Variant>& variants) {
  std::vector<Candidate> candidates;
  for (const Variant& variant : variants) {
    Candidate candidate{variant, squareCloth(size, variant), {}, nullptr};
    candidate.inputs = inputsOf(candidate.scene, variant);
    simulation::SimulationOptions options{settings.rowsPerInvocation, settings.workgroupSize, {}};
    if (variant.builtin) options.advanceKernel = &kernels::advance_mass_spring_builtin;
    candidate.simulated = std::make_unique<Simulated>(device, candidate.scene, options);
    candidate.referenceSeconds = candidate.simulated->check(candidate.inputs);
    candidates.push_back(std::move(candidate));
  }
  const double floor = secondsToCopyTexels(device, std::size_t{size} * size) * kTexelsMovedPerNodeStep;

  for (Candidate& candidate : candidates) {
    candidate.simulated->tick(candidate.inputs);
    candidate.simulated->forgetTimes();
  }
  constexpr std::size_t kLeastRounds = 7;
  const double budget = settings.seconds * static_cast<double>(candidates.size());
  double spent = 0;
  while (spent < budget || candidates.front().simulated->wall().count() < kLeastRounds)
    for (Candidate& candidate : candidates)
      spent += secondsOf([&] { candidate.simulated->tick(candidate.inputs); });

  Rows rows;
  const double nodes = static_cast<double>(size) * size;
  for (const Candidate& candidate : candidates) {
    const double nodeSteps = nodes * candidate.scene.substeps;
    const Samples& wall = candidate.simulated->wall();
    const double nanoseconds = 1e9 / nodeSteps;
    rows.push_back({{"suite", "mass_spring"},
                    {"size", size},
                    {"nodes", size * size},
                    {"springDamping", candidate.variant.springDamping},
                    {"air", candidate.variant.air},
                    {"spheres", candidate.variant.spheres},
                    {"shape", candidate.variant.mesh ? "mesh" : "grid"},
                    {"arithmetic", candidate.variant.builtin ? "builtin" : "deterministic"},
                    {"nodeStepsPerSecond", nodeSteps / wall.median()},
                    {"nsMin", wall.min() * nanoseconds},
                    {"nsMedian", wall.median() * nanoseconds},
                    {"nsP99", wall.p99() * nanoseconds},
                    {"advanceNs", candidate.simulated->advance().median() * nanoseconds},
                    {"floorNs", floor * 1e9 / nodes},
                    {"floorRatio", wall.median() / (floor * candidate.scene.substeps)},
                    {"referenceNs", candidate.referenceSeconds * nanoseconds},
                    {"ticks", wall.count()},
                    {"device", device.info().name}});
  }
  return rows;
}

}  // namespace

void runMassSpring(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const std::uint32_t detailed = settings.size.value_or(256);
  for (std::uint32_t size = settings.size.value_or(32);; size *= 2) {
    if (!fits(device, size)) {
      if (!settings.size) break;
      throw std::runtime_error("a grid of this size does not fit into the device's or the machine's memory");
    }
    std::vector<Variant> variants{Variant{}};
    if (size == detailed)
      variants.insert(variants.end(), {{.builtin = true},
                                       {.springDamping = true},
                                       {.springDamping = true, .builtin = true},
                                       {.air = true},
                                       {.springDamping = true, .air = true},
                                       {.spheres = 1},
                                       {.spheres = 16},
                                       {.mesh = true},
                                       {.springDamping = true, .air = true, .mesh = true}});
    for (const Row& row : measureSize(device, settings, size, variants)) add(row);
    if (settings.size) break;
  }
}

}  // namespace clothstream::bench
