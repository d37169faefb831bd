// SPDX-License-Identifier: MIT
#include "server/doctor/device.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <memory>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <time.h>

#include "server/doctor/crowd.h"
#include "server/encode/frame_encoder.h"
#include "server/model/price.h"
#include "server/simulation/cloth_simulation.h"
#include "server/simulation/speed_meter.h"
#include "server/vulkan/recorder.h"

namespace clothstream::doctor {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::uint32_t kRate = 72, kFirstSize = 32, kMaxSize = 4096, kTicks = 12;
// A crowd's sheets swing for this time before they are representative.
constexpr std::uint32_t kCrowdTicks = 36;
constexpr std::size_t kNodeBytes = 16;  // of the largest binding of a scene

// A square metre that hangs by its upper edge.
model::Scene sheet(std::uint32_t size, model::SolverKind kind, std::uint32_t substeps) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 0.2f;
  cloth.damping = 1;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = size - 1}};
  cloth.solver.kind = kind;
  model::Scene scene;
  scene.name = "capacity";
  scene.simulationRate = scene.streamRate = kRate;
  scene.substeps = substeps;
  const double h = scene.substepSeconds(), bearable = double{cloth.nodeMass()} / (h * h);
  cloth.structural.stiffness = static_cast<float>(0.2 * bearable);
  cloth.shear.stiffness = static_cast<float>(0.1 * bearable);
  cloth.bend.stiffness = static_cast<float>(0.02 * bearable);
  scene.cloths = {cloth};
  return scene;
}

// Processor time of this thread, seconds.
double processorSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double medianOf(std::vector<double>& samples) {
  std::ranges::nth_element(samples, samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 2));
  return samples[samples.size() / 2];
}

struct TickTimes {
  double tick = 0;   // with its packet
  double frame = 0;  // processor time of the packet
};

// Median times in seconds, after the first ticks.
TickTimes measureTicks(vulkan::Device& device, const model::Scene& scene, std::uint32_t ticks) {
  simulation::ClothSimulation simulation(device, scene);
  encode::FrameEncoder encoder(device, simulation, encode::streamLayout(scene, 1));
  vulkan::Recorder recorder(device);
  std::vector<std::byte> packet(encoder.packetBound());
  std::vector<double> times, frames;
  for (std::uint32_t tick = 0; tick < ticks; ++tick) {
    const Clock::time_point before = Clock::now();
    recorder.begin();
    simulation.recordTick(recorder, simulation::inputsAt(scene, tick));
    const encode::RecordedFrame frame = encoder.record(recorder, tick + 1, false);
    device.wait(device.submit(recorder));
    const double began = processorSeconds();
    encoder.entropyCode(frame, packet);
    // The first ticks compile kernels and make a key frame.
    if (tick < 2) continue;
    frames.push_back(processorSeconds() - began);
    times.push_back(Seconds(Clock::now() - before).count());
  }
  return {.tick = medianOf(times), .frame = medianOf(frames)};
}

Finding capacityOf(const OptionsFor& options, const char* method, model::SolverKind kind,
                   std::uint32_t substeps, Clock::time_point end) {
  std::uint32_t fits = 0, size = kFirstSize;
  double fitting = 0;
  bool measuredAll = true;
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  std::string stopped;
  for (; size <= kMaxSize; size += size / 2) {
    if (size > kFirstSize && Clock::now() >= end) {
      measuredAll = false;
      break;
    }
    try {
      vulkan::Device device(options(size * size));
      const double seconds = measureTicks(device, sheet(size, kind, substeps), kTicks).tick;
      rows.push_back({{"size", size}, {"tickMs", 1e3 * seconds}});
      if (seconds > kUsedShare / kRate) break;
      fits = size;
      fitting = seconds;
    } catch (const std::exception& error) {
      stopped = error.what();
      break;
    }
  }
  Finding finding{.level = Level::good,
                  .topic = "capacity",
                  .text = fmt::format("{}: {}x{} nodes at {} Hz, in {:.2f} ms a tick with its packet", method,
                                      fits, fits, kRate, 1e3 * fitting),
                  .figures = {{"method", method}, {"size", fits}, {"ticks", std::move(rows)}}};
  if (!stopped.empty()) finding.text += fmt::format("; {}x{} is not possible: {}", size, size, stopped);
  if (!measuredAll) finding.text += "; larger ones were not tried in this time";
  if (fits == 0) {
    finding.level = Level::problem;
    finding.text = fmt::format("{}: not even {}x{} nodes run at {} Hz{}{}", method, kFirstSize, kFirstSize,
                               kRate, stopped.empty() ? "" : ": ", stopped);
    finding.fix = "Stop other programs that use the device, or use a faster one (--device)";
  }
  return finding;
}

Finding crowdOf(const OptionsFor& options, std::uint32_t size) try {
  model::Scene scene = sheet(size, model::SolverKind::massSpring, 10);
  scene.cloths.front().pins.front().columnStep = size - 1;  // hangs by two corners
  vulkan::Device device(options(size * size));
  const double frame = measureTicks(device, scene, kCrowdTicks).frame;
  const model::DeviceSpeed speed = simulation::SpeedMeter(device).measure();
  const CrowdCost cost = costOf(model::PriceModel(scene).work(scene), speed, frame);
  const Machine machine{.processors = std::max(1u, std::thread::hardware_concurrency()),
                        .software = device.isSoftware()};
  const CarriedScenes carried = carriedScenes(cost, machine, kRate);
  Finding finding{
      .level = Level::good,
      .topic = "crowd",
      .text = fmt::format(
          "about {} scenes of {} vertices at {} Hz, by an estimate from measurements on this machine: {:.0f} "
          "us of the device for each in a tick, {:.0f} us for all together, and {:.0f} us of a processor for "
          "each frame; the {} the limit",
          carried.count, scene.nodeCount(), kRate, 1e6 * cost.ownSeconds, 1e6 * cost.sharedSeconds,
          1e6 * cost.frameSeconds, carried.byProcessors ? "processors are" : "device is"),
      .figures = {{"vertices", scene.nodeCount()},
                  {"scenes", carried.count},
                  {"limit", carried.byProcessors ? "processors" : "device"},
                  {"deviceUsOfScene", 1e6 * cost.ownSeconds},
                  {"deviceUsOfAll", 1e6 * cost.sharedSeconds},
                  {"processorUsOfFrame", 1e6 * cost.frameSeconds},
                  {"processors", machine.processors}}};
  if (carried.count == 0) {
    finding.level = Level::advice;
    finding.fix = "Stop other programs that use the device, or use a faster one (--device)";
  }
  return finding;
} catch (const std::exception& error) {
  return {.level = Level::problem,
          .topic = "crowd",
          .text = fmt::format("scenes of {}x{} nodes cannot be measured: {}", size, size, error.what())};
}

}  // namespace

Findings checkDevices(const vulkan::DeviceOptions& options) {
  Findings findings;
  try {
    for (const vulkan::DeviceInfo& info : vulkan::listDevices())
      findings.push_back({.level = Level::good,
                          .topic = "device",
                          .text = fmt::format("{}: {}", info.index, vulkan::describe(info))});
    const vulkan::Device device(options);
    const vulkan::Limits& limits = device.limits();
    const std::uint64_t nodes =
        std::min<std::uint64_t>(limits.maxStorageRange / kNodeBytes, limits.maxTexelElements);
    Finding chosen{
        .level = Level::good,
        .topic = "device",
        .text = fmt::format("the server uses {}: {:.1f} GB of memory, scenes of up to {} nodes",
                            device.info().name, static_cast<double>(limits.deviceMemoryBytes) / 1e9, nodes),
        .figures = {{"name", device.info().name},
                    {"driver", device.info().driver},
                    {"software", device.isSoftware()},
                    {"memoryBytes", limits.deviceMemoryBytes},
                    {"maxNodes", nodes}}};
    if (device.isSoftware()) {
      chosen.level = Level::advice;
      chosen.text += "; it is software and computes on the CPU";
      chosen.fix =
          "If this machine has a GPU, its driver is missing. Debian: mesa-vulkan-drivers for AMD and Intel, "
          "nvidia-driver and nvidia-vulkan-icd for NVIDIA. In a container, also pass the device in";
    }
    findings.push_back(std::move(chosen));
  } catch (const std::exception& error) {
    findings.push_back({.level = Level::problem,
                        .topic = "device",
                        .text = error.what(),
                        .fix = "Without a device the server serves only recordings (play)"});
  }
  return findings;
}

Findings measureCapacity(const OptionsFor& options, std::chrono::duration<double> time) {
  const Clock::time_point start = Clock::now();
  const auto until = [&](double part) {
    return start + std::chrono::duration_cast<Clock::duration>(part * time);
  };
  return {capacityOf(options, "mass-spring, 10 substeps", model::SolverKind::massSpring, 10, until(0.5)),
          capacityOf(options, "implicit Euler, 2 substeps", model::SolverKind::implicitEuler, 2, until(1))};
}

Findings estimateCrowds(const OptionsFor& options) {
  return {crowdOf(options, 32), crowdOf(options, 100)};
}

}  // namespace clothstream::doctor
