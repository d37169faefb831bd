// SPDX-License-Identifier: MIT
#include "server/simulation/speed_meter.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>

namespace clothstream::simulation {
namespace {

// The few nodes show the time of a dispatch, the many nodes the time of a node. Both take about a
// millisecond, on two processors and on a GPU. A GPU takes as long for 256x256 nodes as for a few (measured:
// NVIDIA H200).
constexpr std::uint32_t kFewSize = 2, kFewSubsteps = 64, kManySize = 96, kManyOnGpu = 512, kManySubsteps = 8;
constexpr int kTicks = 3;
// A GPU has about this many times the speed of one workgroup: NVIDIA's H100 and H200 have 132
// multiprocessors.
constexpr double kGpuWorkgroups = 128;
// Measured with 64 spheres, 8 boxes and 8 hulls of 32 and 128 faces on grids of 16x16 to 256x256 nodes: a
// sphere takes 1.5 us and a hull of 128 faces 33 us a substep (NVIDIA H200).
constexpr double kGpuSerialStep = 4e-6;

model::Scene sheetOf(std::uint32_t size, std::uint32_t substeps) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 1;
  cloth.structural.stiffness = cloth.shear.stiffness = cloth.bend.stiffness = 1;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = size - 1}};
  model::Scene scene;
  scene.name = "speed";
  scene.substeps = substeps;
  scene.environment.airDensity = 0;
  scene.cloths = {cloth};
  return scene;
}

// A software device runs a workgroup on one of its threads. Device has set the variable.
double workgroupFactorOf(const vulkan::Device& device) {
  if (!device.isSoftware()) return kGpuWorkgroups;
  const char* threads = std::getenv("LP_NUM_THREADS");
  const unsigned processors = std::max(1u, std::thread::hardware_concurrency());
  const int count = threads == nullptr ? static_cast<int>(processors) : std::atoi(threads);
  return std::clamp<double>(count, 1, processors);
}

}  // namespace

SpeedMeter::Sheet::Sheet(vulkan::Device& on, std::uint32_t size, std::uint32_t substeps)
    : device(on), scene(sheetOf(size, substeps)), simulation(on, scene), recorder(on) {}

double SpeedMeter::Sheet::measure() {
  double shortest = std::numeric_limits<double>::infinity();
  for (int tick = 0; tick < kTicks; ++tick) {
    recorder.begin();
    simulation.recordTick(recorder, {scene.environment, {}});
    const auto before = std::chrono::steady_clock::now();
    device.wait(device.submit(recorder));
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - before;
    shortest = std::min(shortest, taken.count());
  }
  return shortest;
}

SpeedMeter::SpeedMeter(vulkan::Device& device)
    : gpu_(device.hasGpuKernels()),
      workgroupFactor_(workgroupFactorOf(device)),
      few_(device, kFewSize, kFewSubsteps),
      many_(device, device.isSoftware() ? kManySize : kManyOnGpu, kManySubsteps) {
  // A software device compiles the kernels when they first run.
  measure();
}

model::DeviceSpeed SpeedMeter::measure() {
  const double dispatch = few_.measure() / kFewSubsteps;
  const double nodes = static_cast<double>(many_.scene.nodeCount()) * kManySubsteps;
  const double many = many_.measure();
  // At least half of the time is the nodes', also if a disturbance has lengthened the few nodes' tick.
  const double forNodes = std::max(many - kManySubsteps * dispatch, many / 2);
  return {.nodeStepSeconds = forNodes / nodes,
          .dispatchSeconds = dispatch,
          .workgroupFactor = workgroupFactor_,
          .gpu = gpu_,
          .serialStepSeconds = few_.device.isSoftware() ? 0 : kGpuSerialStep};
}

}  // namespace clothstream::simulation
