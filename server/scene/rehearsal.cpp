// SPDX-License-Identifier: MIT
#include "server/scene/rehearsal.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <stdexcept>

#include "server/schedule/clock.h"
#include "server/telemetry/log.h"

namespace clothstream::scene {
namespace {

model::Scene after(const model::Scene& scene, std::span<const AcceptedChange> changes) {
  model::Scene changed = scene;
  for (const AcceptedChange& accepted : changes) model::applyChange(changed, accepted.change);
  return changed;
}

}  // namespace

std::size_t Rehearsal::rehearsed(const std::shared_ptr<SceneOnDevice>& on, const model::Scene& scene,
                                 std::span<const AcceptedChange> changes) {
  if (loader_ == nullptr) return changes.size();
  if (isUnderWay()) return 0;
  if (making_.valid()) {
    const std::size_t ready = std::min(count_, changes.size());
    try {
      Made made = making_.get();
      seconds_ += *took_;
      loaded_ = std::move(made.loaded);
      on->simulation.takeStages(std::move(made.stages));
      // Others may wait instead, after a restart of the scene.
      if (!on->simulation.makesStages(after(scene, changes.first(ready)).cloths)) return ready;
    } catch (const vulkan::DeviceLost&) {
      throw;
    } catch (const std::exception& failure) {  // the changes will say so, if they have no room either
      seconds_ += *took_;
      telemetry::log({scene.name}, spdlog::level::debug, "a change was not rehearsed: {}", failure.what());
      return ready;
    }
  }
  begin(on, after(scene, changes));
  count_ = changes.size();
  return 0;
}

void Rehearsal::begin(const std::shared_ptr<SceneOnDevice>& on, model::Scene changed) {
  stop_ = std::stop_source();
  took_ = std::make_shared<double>(0);
  making_ = loader_->run([&loader = *loader_, on, took = took_, stop = stop_.get_token(),
                          plan = on->simulation.planStages(changed.cloths), scene = std::move(changed)] {
    const struct Measure {
      double& seconds;
      schedule::Clock::time_point began = schedule::Clock::now();
      ~Measure() { seconds = schedule::seconds(schedule::Clock::now() - began); }
    } measure{*took};
    Made made{.on = on, .loaded = loader.loadNow(on->device, scene, stop), .stages = nullptr};
    if (stop.stop_requested()) throw std::runtime_error("the rehearsal was stopped");
    made.stages = on->simulation.makeStages(plan);
    return made;
  });
}

bool Rehearsal::isUnderWay() const {
  return making_.valid() && making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
}

void Rehearsal::dropFinished() {
  if (!making_.valid() || isUnderWay()) return;
  seconds_ += *took_;
  making_ = {};
}

void Rehearsal::end() {
  stop_.request_stop();
  making_ = {};
  loaded_.reset();
}

}  // namespace clothstream::scene
