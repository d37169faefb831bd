// SPDX-License-Identifier: MIT
#include "server/scene/scene_parameters.h"

#include <algorithm>
#include <stdexcept>

#include "server/schedule/clock.h"

namespace clothstream::scene {
namespace {

// Price of a second of a rehearsal, in seconds of schedule::MakingLimit: it takes a processor, and other
// scenes go on.
constexpr double kRehearsalCost = 0.2;

}  // namespace

SceneParameters::SceneParameters(const model::Scene& start, SceneLoader* loader)
    : scene_(start), easing_(start.cloths.size()), rehearsal_(loader) {}

void SceneParameters::restore(const model::Scene& scene, std::vector<std::uint64_t> easeUntil) {
  scene_ = scene;
  easing_ = SolverEasing(std::move(easeUntil));
  changed_ = true;
}

void SceneParameters::beginTick() {
  makingTime_ = {};
  making_.beginTick();
}

void SceneParameters::endEasing(SceneOnDevice& on, std::uint64_t tick) {
  if (easing_.end(scene_, tick)) upload(on);
}

SceneParameters::Applied SceneParameters::apply(const std::shared_ptr<SceneOnDevice>& on,
                                                std::span<const AcceptedChange> changes, std::uint64_t tick,
                                                Clock::time_point now) {
  if (!makesStages(on->simulation, changes)) {
    rehearsal_.dropFinished();
  } else {
    if (!making_.allows(now)) return {};
    changes = changes.first(rehearsal_.rehearsed(on, scene_, changes));
    if (const double seconds = rehearsal_.takeSeconds(); seconds > 0)
      making_.pay(now, kRehearsalCost * seconds);
  }
  if (changes.empty()) return {};
  Applied applied = applyAll(*on, changes, tick, now);
  // One of them has room, or is the problem.
  if (applied.count == 0 && changes.size() > 1) applied = applyAll(*on, changes.first(1), tick, now);
  return applied;
}

bool SceneParameters::makesStages(const simulation::ClothSimulation& simulation,
                                  std::span<const AcceptedChange> changes) const {
  if (changes.empty()) return false;
  model::Scene changed = scene_;
  for (const AcceptedChange& accepted : changes) model::applyChange(changed, accepted.change);
  return simulation.makesStages(changed.cloths);
}

SceneParameters::Applied SceneParameters::applyAll(SceneOnDevice& on, std::span<const AcceptedChange> changes,
                                                   std::uint64_t tick, Clock::time_point now) {
  model::Scene next = scene_;
  SolverEasing easing = easing_;
  for (const AcceptedChange& accepted : changes) {
    model::Scene changed = next;
    model::applyChange(changed, accepted.change);
    easing.change(next, changed, tick);
    next = std::move(changed);
  }
  const std::uint64_t made = on.simulation.stagesMade();
  const Clock::duration madeIn = makingTime_;
  Applied applied{.count = changes.size()};
  if (std::ranges::any_of(changes, [](const AcceptedChange& each) { return !each.change.cloths.empty(); })) {
    try {
      setCloths(on, next.cloths);
    } catch (const vulkan::DeviceLost&) {
      throw;
    } catch (const std::runtime_error& noRoom) {
      applied = {.count = 0, .problem = noRoom.what()};
    }
  }
  if (on.simulation.stagesMade() > made) making_.pay(now, schedule::seconds(makingTime_ - madeIn));
  if (applied.count == 0) return applied;
  scene_ = std::move(next);
  easing_ = std::move(easing);
  changed_ = true;
  return applied;
}

void SceneParameters::replace(SceneOnDevice& on, model::Scene scene, std::uint64_t tick) {
  easing_.change(scene_, scene, tick);
  setCloths(on, scene.cloths);
  scene_ = std::move(scene);
  changed_ = true;
}

void SceneParameters::undo(const model::Environment& environment, const std::vector<model::Cloth>& cloths) {
  scene_.environment = environment;
  scene_.cloths = cloths;
  changed_ = clothsChanged_ = true;
}

void SceneParameters::payFirstRun(Clock::time_point start, double seconds) {
  if (making_.made()) making_.pay(start, seconds);
}

void SceneParameters::setCloths(SceneOnDevice& on, const std::vector<model::Cloth>& cloths) {
  const struct Measure {
    Clock::duration& time;
    Clock::time_point began = Clock::now();
    ~Measure() { time += Clock::now() - began; }
  } measure{makingTime_};
  on.simulation.setCloths(cloths);
  clothsChanged_ = true;
}

}  // namespace clothstream::scene
