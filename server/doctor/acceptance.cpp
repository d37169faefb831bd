// SPDX-License-Identifier: MIT
#include "server/doctor/acceptance.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/messages/scene_file.h"
#include "server/model/price.h"
#include "server/simulation/cloth_simulation.h"
#include "server/simulation/speed_meter.h"
#include "server/vulkan/batch.h"
#include "server/vulkan/recorder.h"

namespace clothstream::doctor {
namespace {

using Clock = std::chrono::steady_clock;

struct Simulated {
  Simulated(const vulkan::Device& device, const model::Scene& scene)
      : simulation(device, scene), recorder(device) {}
  simulation::ClothSimulation simulation;
  vulkan::Recorder recorder;
};

// Everything that is lost with a device.
struct Run {
  // `together`: on a device that shares kernels, a copy of the scene runs in one batch with the scene.
  Run(const vulkan::DeviceOptions& options, const model::Scene& scene, bool together)
      : device(options), batch(device) {
    const std::size_t copies = together && device.sharesKernels() ? 2 : 1;
    for (std::size_t i = 0; i < copies; ++i) all.push_back(std::make_unique<Simulated>(device, scene));
  }

  // Records with `record` for all copies, submits and waits.
  void submit(const auto& record) {
    batch.begin();
    for (const auto& one : all) {
      one->recorder.begin();
      record(*one);
      if (all.size() > 1) batch.add(one->recorder);
    }
    device.wait(all.size() > 1 ? device.submit(batch) : device.submit(all.front()->recorder));
  }

  vulkan::Device device;
  vulkan::Batch batch;
  std::vector<std::unique_ptr<Simulated>> all;
};

}  // namespace

Finding accept(const OptionsFor& options, const AcceptedState& expected,
               const std::function<bool()>& interrupted) {
  const auto loaded = messages::loadScene(std::string(expected.scene));
  if (!loaded) throw std::runtime_error(loaded.error().text);
  const model::Scene& scene = *loaded;
  const vulkan::DeviceOptions deviceOptions = options(scene.nodeCount());
  std::vector<double> times;
  simulation::StateSnapshot saved;
  std::uint64_t found = 0;
  double price = 0;
  for (const bool again : {false, true}) {
    Run run(deviceOptions, scene, again);
    if (again) run.submit([&](Simulated& one) { one.simulation.recordRestoreState(one.recorder, saved); });
    const std::uint32_t first = again ? kAcceptedTicks / 2 : 0, end = first + kAcceptedTicks / 2;
    for (std::uint32_t tick = first; tick < end; ++tick) {
      if (interrupted()) throw std::runtime_error("interrupted");
      const Clock::time_point before = Clock::now();
      run.submit([&](Simulated& one) {
        one.simulation.recordTick(one.recorder, simulation::inputsAt(scene, tick));
        if (tick + 1 == end) one.simulation.recordSaveState(one.recorder);
      });
      if (run.all.size() == 1) times.push_back(std::chrono::duration<double>(Clock::now() - before).count());
    }
    for (const auto& one : run.all) {
      saved = one->simulation.collectState(end);
      found = simulation::statusOf(saved).stateHash;
      if (found != expected.hash) break;
    }
    if (again)
      price = model::PriceModel(scene).work(scene).seconds(simulation::SpeedMeter(run.device).measure());
  }
  std::ranges::nth_element(times, times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2));
  const double tick = times[times.size() / 2];
  Finding finding{
      .level = Level::good,
      .topic = "acceptance",
      .text = fmt::format("{}: the state after {} ticks is right; {:.3f} ms a tick, priced {:.3f} ms",
                          expected.scene, kAcceptedTicks, 1e3 * tick, 1e3 * price),
      .figures = {{"scene", expected.scene},
                  {"nodes", scene.nodeCount()},
                  {"hash", fmt::format("{:016x}", found)},
                  {"expected", fmt::format("{:016x}", expected.hash)},
                  {"tickMs", 1e3 * tick},
                  {"priceMs", 1e3 * price}}};
  if (found != expected.hash) {
    finding.level = Level::problem;
    finding.text = fmt::format("{}: after {} ticks the state has the hash {:016x} instead of {:016x}",
                               expected.scene, kAcceptedTicks, found, expected.hash);
    finding.fix =
        "Recordings will not repeat on this device. Update its driver; if that does not help, report it";
  }
  return finding;
}

}  // namespace clothstream::doctor
