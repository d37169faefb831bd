// SPDX-License-Identifier: MIT
#include "server/hosting/scene_run.h"

#include <cassert>
#include <chrono>
#include <cmath>
#include <future>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/envelope.h"
#include "server/telemetry/log.h"

namespace clothstream::hosting {

SceneRun::SceneRun(std::shared_ptr<scene::LiveScene> live)
    : TickSchedule(live->start().simulationRate, live->isGuest()),
      scene(std::move(live)),
      harm(scene->terms.created),
      overload(scene->start().streamRate, scene->start().substeps) {}

void SceneRun::become(SceneState next) {
  assert(next == state_ || mayBecome(state_, next));
  state_ = next;
  begun = isTicking(next);
  running = begun || next == SceneState::running;
}

bool SceneRun::needsLoading(Clock::time_point now) const {
  if (state_ == SceneState::interrupted) return true;
  return state_ == SceneState::asleep && (arrival.isUnderWay() || scene->subscribers.receivers(now) > 0);
}

void SceneRun::load(OwnedDevice& device) {
  loading_.stop = std::stop_source();
  loading_.future = device.loader().load(*device, scene->start(), loading_.stop.get_token());
  become(SceneState::loading);
}

bool SceneRun::isLoaded() const {
  if (state_ == SceneState::prepared) return !arrival.waits();
  return state_ == SceneState::loading &&
         loading_.future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

std::unique_ptr<scene::SceneOnDevice> SceneRun::takeLoaded() {
  return state_ == SceneState::prepared ? std::move(loading_.prepared) : loading_.future.get();
}

void SceneRun::keepPrepared(std::unique_ptr<scene::SceneOnDevice> loaded) {
  loading_.prepared = std::move(loaded);
  become(SceneState::prepared);
}

void SceneRun::abandonLoading() {
  loading_.stop.request_stop();
  loading_.future = {};
  loading_.prepared.reset();
  if (host) host->endRehearsal();
  if (state_ == SceneState::loading || state_ == SceneState::prepared)
    become(host ? SceneState::interrupted : SceneState::asleep);
}

bool SceneRun::usesLoader() const {
  return state_ == SceneState::loading || (host && host->isRehearsing());
}

void SceneRun::startOrStop(Clock::time_point now, bool runAlways, bool mustWait) {
  guest = scene->isGuest();
  if (begun || state_ == SceneState::quarantined || departure.isHeld()) return;
  if (!isOnDevice(state_)) {
    scene->running = false;
    return;
  }
  const bool inUse = scene->subscribers.receivers(now) > 0;
  const bool stopped = scene->paused && !scene->resetRequested && !host->owesFrame();
  const bool wanted = !stopped && (runAlways || inUse);
  const bool stands = state_ == SceneState::idle || (state_ == SceneState::paused && inUse);
  if (!wanted && !stands) {
    host->releaseCoarseEncoders();
    host->endRehearsal();
  }
  if (wanted && !running) {
    pacer.start(now);
    slow_.restart();
    overload.restart();
  }
  const SceneState next = wanted ? SceneState::running : inUse ? SceneState::paused : SceneState::idle;
  become(mustWait ? SceneState::idle : next);
  scene->running = wanted;
}

Clock::time_point SceneRun::due() const {
  if (begun) return {};  // now
  if (running) return pacer.due();
  return state_ == SceneState::paused ? nextPausedFrame : Clock::time_point::max();
}

void SceneRun::beginTick(Clock::time_point now, const model::DeviceSpeed& speed) {
  const schedule::Pacer::Start start = pacer.begin(now, catchUp);
  scene->metrics.lateness.record(schedule::seconds(start.lateness));
  if (start.late) scene->metrics.lateTicks.add();
  scene->metrics.slippedTicks.add(wholeSlippedTicks(start.slippedTicks));
  tick.slippedTicks = start.slippedTicks;
  if (const std::optional<double> slow = slow_.note(now, start.slippedTicks)) {
    const std::string text = fmt::format(
        "simulated time runs at {:.0f} % of real time: the device cannot keep {} ticks/s with {} substeps",
        *slow * 100, scene->start().simulationRate, scene->work.load().substeps);
    telemetry::log({scene->name()}, spdlog::level::warn, "{}", text);
    scene->subscribers.announce(delivery::notice(v1::NOTICE_KIND_RUNNING_SLOW, text, host->tick()));
  }
  host->begin(now);
  tick.price = scene->tickWork(host->colliders()).seconds(speed);
  price.begin(tick.price);
}

std::uint64_t SceneRun::wholeSlippedTicks(double ticks) {
  slippedTicks_ += ticks;
  const double whole = std::floor(slippedTicks_);
  slippedTicks_ -= whole;
  return static_cast<std::uint64_t>(whole);
}

void SceneRun::dropTick() {
  if (begun) become(SceneState::running);
}

void SceneRun::stand() {
  if (isOnDevice(state_)) become(SceneState::idle);
  scene->running = false;
}

std::optional<scene::Checkpoint> SceneRun::stateNow() {
  if (state_ == SceneState::quarantined || state_ == SceneState::interrupted)
    throw std::runtime_error("it does not run now; try again later");
  if (host) return host->stateNow();
  if (const auto restored = scene->restored()) return restored->checkpoint;
  return std::nullopt;
}

void SceneRun::release() {
  if (!host) return;
  host->release();
  become(SceneState::interrupted);
}

void SceneRun::giveUp(const std::string& why) {
  const std::string text = fmt::format("the device cannot run the scene '{}': {}", scene->name(), why);
  spdlog::error("{}", text);
  host.reset();
  become(SceneState::asleep);
  rebuilds.givenUp();
  scene->roster.dismiss(delivery::error(v1::ERROR_CODE_RESOURCE_EXHAUSTED, text, true));
  // For participants that have joined again already.
  scene->subscribers.announce(delivery::parametersChanged(scene->restart(), 1));
}

void SceneRun::quarantine(const std::string& text) {
  spdlog::error("{}", text);
  host.reset();
  become(SceneState::quarantined);
  scene->running = false;
  scene->quarantine(text);
}

}  // namespace clothstream::hosting
