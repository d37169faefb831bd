// SPDX-License-Identifier: MIT
// Writes ticks into a file.
#include "server/step/step.h"

#include <chrono>
#include <cstdio>
#include <vector>

#include <fmt/format.h>

#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "server/simulation/cloth_simulation.h"
#include "server/step/state_file.h"
#include "server/vulkan/recorder.h"

namespace clothstream::step {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

Json describe(std::span<const simulation::ClothReport> reports, double deviceSeconds) {
  Json cloths = Json::array();
  for (const simulation::ClothReport& report : reports)
    cloths.push_back({{"strainMax", report.strainMax},
                      {"strainP99", report.strainP99},
                      {"strainMean", report.strainMean},
                      {"kineticEnergy", report.kineticEnergy},
                      {"elasticEnergy", report.elasticEnergy},
                      {"gravityEnergy", report.gravityEnergy},
                      {"activeConstraints", report.activeConstraints},
                      {"iterations", report.iterations},
                      {"residual", report.residual},
                      {"penetration", report.penetration}});
  return {{"deviceSeconds", deviceSeconds}, {"cloths", std::move(cloths)}};
}

// Device time of the last recording, without the report and the copy of the state.
double tickSeconds(vulkan::Recorder& recorder) {
  double sum = 0;
  for (const vulkan::StageTime& stage : recorder.stageTimes())
    if (stage.stage != "report" && stage.stage != "state") sum += stage.seconds;
  return sum;
}

class Progress {
 public:
  explicit Progress(std::uint64_t ticks) : ticks_(ticks) {}
  void show(std::uint64_t tick) {
    const Clock::time_point now = Clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::seconds(1);
    const double seconds = std::chrono::duration<double>(now - start_).count();
    const double rate = static_cast<double>(tick) / seconds;
    fmt::print(stderr, "tick {} of {} ({} %), {:.1f} ticks/s, {:.0f} s left\n", tick, ticks_,
               100 * tick / ticks_, rate, static_cast<double>(ticks_ - tick) / rate);
  }

 private:
  std::uint64_t ticks_;
  Clock::time_point start_ = Clock::now(), next_ = start_ + std::chrono::seconds(1);
};

// Descriptions of the frames.
struct Frames {
  Json ticks = Json::array(), hashes = Json::array(), reports = Json::array();

  void add(std::uint64_t tick, std::uint64_t hash, Json report) {
    ticks.push_back(tick);
    hashes.push_back(fmt::format("{:016x}", hash));
    reports.push_back(std::move(report));
  }
};

}  // namespace

Outcome run(vulkan::Device& device, const model::Scene& scene, const StepOptions& options,
            const std::function<bool()>& interrupted) {
  StateFile file(options.out);
  simulation::ClothSimulation simulation(device, scene);
  vulkan::Recorder recorder(device);
  const auto submit = [&](const auto& record) {
    recorder.begin();
    record();
    device.wait(device.submit(recorder));
  };
  Frames frames;
  submit([&] { simulation.recordSaveState(recorder); });
  const simulation::StateSnapshot start = simulation.collectState(0);
  file.append(simulation::inWorld(start).bytes);
  frames.add(0, simulation::statusOf(start).stateHash, nullptr);

  Outcome outcome = Outcome::complete;
  Progress progress(options.ticks);
  for (std::uint64_t tick = 1; tick <= options.ticks && outcome == Outcome::complete; ++tick) {
    const bool wanted = tick % options.every == 0;
    const simulation::TickInputs inputs = simulation::inputsAt(scene, tick - 1);
    submit([&] {
      simulation.recordTick(recorder, inputs);
      if (!wanted) return;
      simulation.recordReport(recorder, inputs);
      simulation.recordSaveState(recorder);
    });
    const simulation::TickStatus status = simulation.status();
    if (!status.healthy) {
      outcome = Outcome::unhealthy;
      fmt::print(stderr, "tick {}: {}; {} ends with the {} frames before it\n", tick,
                 status.outOfReach ? messages::outOfReach(scene)
                                   : std::string("the state left the range of numbers"),
                 options.out.string(), file.frames());
    } else if (wanted) {
      file.append(simulation::inWorld(simulation.collectState(tick)).bytes);
      frames.add(tick, status.stateHash, describe(simulation.report(), tickSeconds(recorder)));
    }
    progress.show(tick);
    if (outcome == Outcome::complete && tick < options.ticks && interrupted()) {
      outcome = Outcome::interrupted;
      fmt::print(stderr, "interrupted after tick {}: {} has {} frames\n", tick, options.out.string(),
                 file.frames());
    }
  }
  const vulkan::DeviceInfo& info = device.info();
  file.finish({{"complete", outcome == Outcome::complete},
               {"tickSeconds", scene.tickSeconds()},
               {"ticks", std::move(frames.ticks)},
               {"hashes", std::move(frames.hashes)},
               {"cloths", describeCloths(scene)},
               {"reports", std::move(frames.reports)},
               {"device", {{"name", info.name}, {"driver", info.driver}, {"vulkan", info.apiVersion}}},
               {"server", options.serverName},
               {"scene", Json::parse(messages::toJson(scene))}},
              simulation.nodeCount());
  return outcome;
}

}  // namespace clothstream::step
