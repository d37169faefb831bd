// SPDX-License-Identifier: MIT
// Scenes that arrive on the device's thread, and states of scenes for other servers.
#pragma once

#include <cassert>
#include <cstdint>
#include <exception>
#include <future>
#include <optional>
#include <utility>

#include "server/hosting/scene_state.h"
#include "server/scene/checkpoint.h"

namespace clothstream::hosting {

// Call of DeviceThread::add(), or of prepare() and then start(). Belongs to one thread.
class Arrival {
 public:
  // `waits`: the scene is loaded, and then waits for start().
  void begin(std::promise<void> ready, bool waits) {
    ready_ = std::move(ready);
    waits_ = waits;
  }
  // The scene waits, and may run now.
  void start(std::promise<void> ready) {
    assert(waits_);
    begin(std::move(ready), false);
  }

  bool waits() const { return waits_; }
  // Returns whether the scene is needed although it has no subscribers yet.
  bool isUnderWay() const { return waits_ || ready_; }

  // The scene is loaded; unless it waits, it can run.
  void succeed() {
    if (ready_) std::exchange(ready_, std::nullopt)->set_value();
  }
  // Returns false if no caller waits.
  bool fail(const std::exception_ptr& why) {
    if (!ready_) return false;
    std::exchange(ready_, std::nullopt)->set_exception(why);
    return true;
  }

 private:
  std::optional<std::promise<void>> ready_;
  bool waits_ = false;
};

// Call of DeviceThread::hold() or read(), and whether the scene is held. Belongs to one thread.
class Departure {
 public:
  using State = std::optional<scene::Checkpoint>;

  // `holds`: the scene is held from then on. If it runs, it first runs its ticks up to `tick`.
  void request(std::promise<State> state, bool holds, std::uint64_t tick) {
    assert(!isBusy());
    state_ = std::move(state);
    holds_ = holds;
    tick_ = tick;
  }
  // Returns whether there can be no request now.
  bool isBusy() const { return state_ || held_; }

  // Returns whether the state of the scene after its newest tick answers a request.
  bool isDue(SceneState state, std::uint64_t newestTick) const {
    if (!state_ || state == SceneState::loading || isTicking(state)) return false;
    return state != SceneState::running || newestTick >= tick_;
  }
  // Returns whether give() will hold the scene.
  bool holds() const { return holds_; }
  void give(State state) {
    held_ = holds_;
    std::exchange(state_, std::nullopt)->set_value(std::move(state));
  }
  // The scene goes on.
  void fail(const std::exception_ptr& why) { std::exchange(state_, std::nullopt)->set_exception(why); }

  bool isHeld() const { return held_; }
  void release() { held_ = false; }

 private:
  std::optional<std::promise<State>> state_;
  bool holds_ = false, held_ = false;
  std::uint64_t tick_ = 0;
};

}  // namespace clothstream::hosting
