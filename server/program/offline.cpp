// SPDX-License-Identifier: MIT
// Commands that simulate without network: `clothstream-server resimulate` and `step`.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "proto/recording/verdict.h"
#include "proto/text/printable.h"
#include "server/messages/scene_file.h"
#include "server/model/scene.h"
#include "server/program/commands.h"
#include "server/program/scenes.h"
#include "server/recording/resimulate.h"
#include "server/simulation/software_threads.h"
#include "server/step/state_file.h"
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

// Writes the simulated states and, at the end, their description.
class States {
 public:
  explicit States(const std::filesystem::path& path) : file_(path) {}

  void add(const recording::SimulatedState& state) {
    if (file_.frames() == 0) {
      nodes_ = state.scene.nodeCount();
      description_ = {{"tickSeconds", state.scene.tickSeconds()},
                      {"cloths", step::describeCloths(state.scene)},
                      {"scene", Json::parse(messages::toJson(state.scene))}};
    }
    file_.append(simulation::inWorld(state.snapshot).bytes);
    ticks_.push_back(state.snapshot.tick);
    hashes_.push_back(fmt::format("{:016x}", state.hash));
    if (!state.same) different_.push_back(state.snapshot.tick);
  }

  void finish(const recording::Resimulation& result, const std::string& recording) {
    description_.update({{"complete", !result.interrupted && result.missing.empty()},
                         {"ticks", std::move(ticks_)},
                         {"hashes", std::move(hashes_)},
                         {"differentTicks", std::move(different_)},
                         {"recording", recording},
                         {"device", {{"name", result.device}}},
                         {"server", kServerName}});
    file_.finish(description_, nodes_);
  }

 private:
  using Json = nlohmann::ordered_json;

  step::StateFile file_;
  std::uint32_t nodes_ = 0;
  Json description_, ticks_ = Json::array(), hashes_ = Json::array(), different_ = Json::array();
};

int failedWith(int code, const std::string& error) {
  fmt::print(stderr, "clothstream-server: {}\n", printable(error));
  return code;
}

int runResimulation(const ResimulateOptions& options, const vulkan::DeviceOptions& device,
                    const Signals& signals) {
  std::error_code none;
  if (std::filesystem::equivalent(options.recording, options.states, none))
    return failedWith(recording::kWrongArguments,
                      fmt::format("--states: {} is the recording; choose another file", options.recording));
  std::unique_ptr<States> states;
  const auto add = [&](const recording::SimulatedState& state) {
    if (!states) states = std::make_unique<States>(options.states);
    states->add(state);
  };
  Progress progress;
  recording::ResimulateOptions resimulation{
      .path = options.recording,
      .limits = options.limits,
      .device = [&](std::uint32_t nodes) { return simulation::suitedTo(nodes, device); },
      .interrupted = [&] { return signals.interrupted(); },
      .progress = [&](double part) { progress.show(part); }};
  if (!options.states.empty()) resimulation.states = add;
  const auto result = recording::resimulate(resimulation);
  if (!result) return failedWith(recording::kFileUnreadable, result.error());
  if (states) states->finish(*result, options.recording);
  fmt::print("{}", options.json ? recording::toJson(*result) : recording::toText(*result));
  return result->interrupted ? kInterrupted : static_cast<int>(result->verdict());
}

}  // namespace

int resimulate(const ResimulateOptions& options, const vulkan::DeviceOptions& device,
               const Signals& signals) {
  try {
    return runResimulation(options, device, signals);
  } catch (const step::FileError& error) {
    return failedWith(recording::kFileNotWritten, error.what());
  } catch (const std::exception& error) {
    return failedWith(recording::kProgramFailed, error.what());
  }
}

int runSteps(const StepOptions& options, const vulkan::DeviceOptions& deviceOptions, const Signals& signals) {
  const model::Scene scene = adjusted(loadScene(options.scene), options);
  vulkan::Device device(simulation::suitedTo(scene.nodeCount(), deviceOptions));
  step::StepOptions stepOptions = options.run;
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
