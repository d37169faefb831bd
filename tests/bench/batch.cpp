// SPDX-License-Identifier: MIT
// Suite batch: a tick of many equal scenes in one submission, from one scene to a thousand.
#include "server/vulkan/batch.h"

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/hung_cloth.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kSize = 32;  // rows and columns
constexpr std::size_t kLeastTicks = 7;

struct Member {
  Member(vulkan::Device& device, const model::Scene& scene) : simulation(device, scene), recorder(device) {}
  simulation::ClothSimulation simulation;
  vulkan::Recorder recorder;
};

class Crowd {
 public:
  Crowd(vulkan::Device& device, const model::Scene& scene, std::uint32_t scenes)
      : device_(device), scene_(scene), batch_(device) {
    while (members_.size() < scenes) members_.push_back(std::make_unique<Member>(device, scene));
  }

  // Runs the next tick of all scenes.
  void tick() {
    const simulation::TickInputs inputs = hungClothInputs(scene_, ticks_++);
    wall_.add(secondsOf([&] {
      batch_.begin();
      for (const auto& member : members_) {
        member->recorder.begin();
        member->simulation.recordTick(member->recorder, inputs);
        batch_.add(member->recorder);
      }
      device_.wait(device_.submit(batch_));
    }));
    batch_.shareTimes();
    double seconds = 0;
    for (const auto& member : members_)
      for (const vulkan::StageTime& time : member->recorder.stageTimes()) seconds += time.seconds;
    onDevice_.add(seconds);
  }
  // Throws std::runtime_error unless each scene has the state of the same ticks alone.
  void check() const {
    Simulated alone(device_, scene_, {});
    for (std::uint64_t tick = 0; tick < ticks_; ++tick) alone.tick(hungClothInputs(scene_, tick));
    for (std::size_t i = 0; i < members_.size(); ++i)
      if (members_[i]->simulation.status().stateHash != alone.status().stateHash)
        throw std::runtime_error(
            fmt::format("scene {} of {} differs from one that runs alone", i, members_.size()));
  }

  const vulkan::CommandCounts& commands() const { return batch_.counts(); }
  // Times of ticks in seconds: with recording, submission and waiting, and by the device's clock.
  const Samples& wall() const { return wall_; }
  const Samples& onDevice() const { return onDevice_; }
  void forgetTimes() { wall_ = onDevice_ = {}; }

 private:
  vulkan::Device& device_;
  const model::Scene& scene_;
  std::vector<std::unique_ptr<Member>> members_;
  vulkan::Batch batch_;
  std::uint64_t ticks_ = 0;
  Samples wall_, onDevice_;
};

Row measure(vulkan::Device& device, const Settings& settings, const model::Scene& scene,
            std::uint32_t scenes) {
  const std::uint64_t before = device.allocatedBytes();
  Crowd crowd(device, scene, scenes);
  crowd.tick();
  crowd.check();
  crowd.forgetTimes();
  double spent = 0;
  while (spent < settings.seconds || crowd.wall().count() < kLeastTicks)
    spent += secondsOf([&] { crowd.tick(); });
  crowd.check();
  return {{"suite", "batch"},
          {"nodes", scene.nodeCount()},
          {"scenes", scenes},
          {"sharesDispatches", device.sharesKernels()},
          {"deviceMsMedian", crowd.onDevice().median() * 1e3},
          {"tickMsMedian", crowd.wall().median() * 1e3},
          {"tickMsP99", crowd.wall().p99() * 1e3},
          {"dispatches", crowd.commands().dispatches},
          {"copies", crowd.commands().copies},
          {"barriers", crowd.commands().barriers},
          {"deviceAllocations", device.allocations()},
          {"deviceMb", static_cast<double>(device.allocatedBytes() - before) / 1e6},
          {"ticks", crowd.wall().count()},
          {"device", device.info().name}};
}

}  // namespace

void runBatch(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const model::Scene scene = hungCloth(settings.size.value_or(kSize));
  Simulated(device, scene, {}).check(hungClothInputs(scene, 0));
  for (const std::uint32_t scenes : settings.crowds) add(measure(device, settings, scene, scenes));
}

}  // namespace clothstream::bench
