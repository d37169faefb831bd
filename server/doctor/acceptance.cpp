// SPDX-License-Identifier: MIT
#include "server/doctor/acceptance.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/messages/scene_file.h"
#include "server/model/price.h"
#include "server/simulation/cloth_simulation.h"
#include "server/simulation/speed_meter.h"
#include "server/vulkan/recorder.h"

namespace clothstream::doctor {
namespace {

using Clock = std::chrono::steady_clock;

// Everything that is lost with a device.
struct Run {
  Run(const vulkan::DeviceOptions& options, const model::Scene& scene)
      : device(options), simulation(device, scene), recorder(device) {}

  void submit(const auto& record) {
    recorder.begin();
    record();
    device.wait(device.submit(recorder));
  }

  vulkan::Device device;
  simulation::ClothSimulation simulation;
  vulkan::Recorder recorder;
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
    Run run(deviceOptions, scene);
    if (again) run.submit([&] { run.simulation.recordRestoreState(run.recorder, saved); });
    const std::uint32_t first = again ? kAcceptedTicks / 2 : 0, end = first + kAcceptedTicks / 2;
    for (std::uint32_t tick = first; tick < end; ++tick) {
      if (interrupted()) throw std::runtime_error("interrupted");
      const Clock::time_point before = Clock::now();
      run.submit([&] {
        run.simulation.recordTick(run.recorder, simulation::inputsAt(scene, tick));
        if (tick + 1 == end) run.simulation.recordSaveState(run.recorder);
      });
      times.push_back(std::chrono::duration<double>(Clock::now() - before).count());
    }
    saved = run.simulation.collectState(end);
    found = simulation::statusOf(saved).stateHash;
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
