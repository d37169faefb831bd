// SPDX-License-Identifier: MIT
#include "server/agones/agones.h"

#include <cmath>
#include <exception>
#include <vector>

#include <spdlog/spdlog.h>

#include "server/hosting/scene_server.h"
#include "server/scene/live_scene.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::agones {

using Answer = Sidecar::Answer;

Agones::Agones(hosting::SceneServer& server, std::uint16_t port, Clock::duration deviceSilence)
    : server_(server), deviceSilence_(deviceSilence), sidecar_(port), thread_([this] { run(); }) {}

Agones::~Agones() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  done("shutdown", sidecar_.shutdown());
}

void Agones::run() {
  telemetry::nameThread("agones");
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    try {
      look(Clock::now());
    } catch (const std::exception& failure) {  // such as no free descriptor
      spdlog::error("Agones: {}; trying again", failure.what());
    }
    lock.lock();
    changed_.wait_for(lock, kPeriod, [this] { return stopping_; });
  }
}

void Agones::look(Clock::time_point now) {
  server_.device.wake();  // it otherwise sleeps while no scene runs; the next call of look() sees its answer
  std::map<std::string, Count> counts;
  std::set<std::string> names;
  for (const auto& scene : server_.scenes.all()) {
    names.insert(scene->name());
    counts[kParticipants].count += static_cast<std::int64_t>(scene->subscribers.size());
    counts[kParticipants].capacity += scene->terms.maxParticipants;
    counts[kCreatedScenes].count += scene->terms.created ? 1 : 0;
  }
  const bool inUse = counts[kParticipants].count > 0 || counts[kCreatedScenes].count > 0;
  counts[kCreatedScenes].capacity = server_.options.maxCreatedScenes;
  const scene::Budget::Usage usage = server_.budget->usage();
  constexpr double kMilliseconds = 1e3;
  counts[kLoad] = {.count = std::llround(kMilliseconds * usage.load),
                   .capacity = std::llround(kMilliseconds * (usage.load + usage.freeLoad))};

  const bool healthy = now - server_.device.lastAnswer() <= deviceSilence_;
  if (phase_ == Phase::starting && !healthy) return;
  choosePhase(inUse, now);
  if (phase_ == Phase::starting) return;
  if (healthy && now >= nextHealth_ && done("health", sidecar_.health())) nextHealth_ = now + kHealthPeriod;
  tellCounts(counts);
  tellScenes(names);
}

void Agones::choosePhase(bool inUse, Clock::time_point now) {
  const bool expected = !inUse && phase_ == Phase::ready && wasAllocated();
  if (inUse || expected) lastInUse_ = now;
  if (expected) phase_ = Phase::allocated;
  if (phase_ == Phase::starting && done("ready", sidecar_.ready())) phase_ = Phase::ready;
  if (phase_ == Phase::ready && inUse && done("allocate", sidecar_.allocate())) phase_ = Phase::allocated;
  if (phase_ == Phase::allocated && now - lastInUse_ > kStaysAllocated && done("ready", sidecar_.ready()))
    phase_ = Phase::ready;
}

bool Agones::wasAllocated() {
  std::string state;
  return done("gameserver", sidecar_.state(state)) && state == "Allocated";
}

void Agones::tellCounts(const std::map<std::string, Count>& counts) {
  for (const auto& [name, count] : counts) {
    const auto known = told_.find(name);
    if (unknown_.contains(name) || (known != told_.end() && known->second == count)) continue;
    const Answer answer = sidecar_.setCounter(name, count.count, count.capacity);
    if (!isUnknown(name, answer) && done("counter", answer)) told_[name] = count;
  }
}

void Agones::tellScenes(const std::set<std::string>& names) {
  if (unknown_.contains(kScenes)) return;
  if (!scenesKnown_) {
    // An earlier container of the pod may have left values.
    std::vector<std::string> values;
    const Answer answer = sidecar_.list(kScenes, values);
    if (isUnknown(kScenes, answer) || !done("list", answer)) return;
    scenesTold_ = {values.begin(), values.end()};
    scenesKnown_ = true;
  }
  for (auto told = scenesTold_.begin(); told != scenesTold_.end();) {
    const bool gone = !names.contains(*told) && done("list", sidecar_.removeFromList(kScenes, *told));
    told = gone ? scenesTold_.erase(told) : std::next(told);
  }
  for (const std::string& name : names)
    if (!scenesTold_.contains(name) && done("list", sidecar_.addToList(kScenes, name)))
      scenesTold_.insert(name);
}

bool Agones::isUnknown(const std::string& name, Answer answer) {
  if (answer != Answer::unknown) return false;
  unknown_.insert(name);
  spdlog::info("Agones: the GameServer has no counter or list '{}'; it is left out", name);
  return true;
}

bool Agones::done(const char* what, Answer answer) {
  if (answer == Answer::ok) {
    failing_ = false;
    return true;
  }
  if (!failing_) spdlog::warn("Agones: {}: {}; trying again", what, sidecar_.problem());
  failing_ = true;
  return false;
}

}  // namespace clothstream::agones
