// SPDX-License-Identifier: MIT
// Commands that simulate without network: `clothstream-server resimulate` and `step`.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <stdexcept>

#include <fmt/format.h>

#include "server/model/scene.h"
#include "server/program/commands.h"
#include "server/program/devices.h"
#include "server/program/scenes.h"
#include "server/recording/resimulate.h"
#include "server/step/step.h"
#include "server/vulkan/device.h"

namespace clothstream::program {
namespace {

// Prints the completed share on standard error, at most once per second.
class Progress {
 public:
  void show(double part) {
    const Clock::time_point now = Clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::seconds(1);
    fmt::print(stderr, "{:.0f} %\n", 100 * part);
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(1);
};

}  // namespace

int resimulate(const ProgramOptions& options, const Signals& signals) {
  Progress progress;
  const auto result =
      recording::resimulate({.path = options.recording,
                             .device = [&](std::uint32_t nodes) { return deviceOptions(options, nodes); },
                             .interrupted = [&] { return signals.interrupted(); },
                             .progress = [&](double part) { progress.show(part); }});
  if (!result) throw std::runtime_error(result.error());
  fmt::print("{}", recording::toText(*result));
  if (result->interrupted) return kInterrupted;
  return result->firstDifferent || !result->missing.empty() ? 1 : 0;
}

int runSteps(const ProgramOptions& options, const Signals& signals) {
  const model::Scene scene = adjusted(loadScene(options.server.defaultScene), options);
  vulkan::Device device(deviceOptions(options, scene.nodeCount()));
  step::StepOptions stepOptions = options.step;
  stepOptions.serverName = kServerName;
  switch (step::run(device, scene, stepOptions, [&] { return signals.interrupted(); })) {
    case step::Outcome::complete:
      return 0;
    case step::Outcome::interrupted:
      return kInterrupted;
    case step::Outcome::unhealthy:
      return 1;
  }
  return 1;
}

}  // namespace clothstream::program
