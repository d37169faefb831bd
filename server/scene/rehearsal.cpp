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

std::size_t Rehearsal::rehearsed(SceneOnDevice& on, const model::Scene& scene,
                                 std::span<const AcceptedChange> changes) {
  if (loader_ == nullptr) return changes.size();
  if (making_.valid()) {
    if (making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return 0;
    const std::size_t ready = std::min(count_, changes.size());
    try {
      Made made = making_.get();
      seconds_ += made.seconds;
      loaded_ = std::move(made.loaded);
      on.simulation.takeStages(std::move(made.stages));
      // Others may wait instead, after a restart of the scene.
      if (!on.simulation.makesStages(after(scene, changes.first(ready)).cloths)) return ready;
    } catch (const vulkan::DeviceLost&) {
      throw;
    } catch (const std::exception& failure) {  // the changes will say so, if they have no room either
      telemetry::log({scene.name}, spdlog::level::debug, "a change was not rehearsed: {}", failure.what());
      return ready;
    }
  }
  begin(on, after(scene, changes));
  count_ = changes.size();
  return 0;
}

void Rehearsal::begin(SceneOnDevice& on, model::Scene changed) {
  use_ = std::make_shared<Use>();
  stop_ = std::stop_source();
  // `on` may have ended before its turn comes, but the loader and the device live.
  making_ = loader_->run([&loader = *loader_, &device = on.device, &on, use = use_, stop = stop_.get_token(),
                          plan = on.simulation.planStages(changed.cloths), scene = std::move(changed)] {
    Made made;
    const schedule::Clock::time_point before = schedule::Clock::now();
    made.loaded = loader.loadNow(device, scene, stop);
    const std::lock_guard lock(use->mutex);
    if (use->ended) throw std::runtime_error("the scene has ended");
    made.stages = on.simulation.makeStages(plan);
    made.seconds = schedule::seconds(schedule::Clock::now() - before);
    return made;
  });
}

void Rehearsal::end() {
  stop_.request_stop();
  if (use_) {
    const std::lock_guard lock(use_->mutex);
    use_->ended = true;
  }
  making_ = {};
  loaded_.reset();
}

}  // namespace clothstream::scene
