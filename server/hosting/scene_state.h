// SPDX-License-Identifier: MIT
// States of a scene on the device's thread, and how they may follow each other.
#pragma once

#include <cstdint>

namespace clothstream::hosting {

enum class SceneState : std::uint8_t {
  asleep,         // not on the device; it is loaded when it is needed
  loading,        // the loader makes its objects on the device
  prepared,       // loaded; it waits for DeviceThread::start()
  idle,           // on the device without ticks: not needed, held, or waiting until another scene is loaded
  paused,         // on the device; new subscribers get key frames
  running,        // waits for its next tick
  inFlight,       // the device works on the first slice of its tick
  betweenSlices,  // its tick has begun, and the device does not work on it
  interrupted,    // lost its objects on the device; it is loaded again, and continues from its newest state
  refused,        // could not be added or started, and is removed
  quarantined,    // stopped for good
};
inline constexpr int kSceneStates = static_cast<int>(SceneState::quarantined) + 1;

// Returns whether its tick has begun, and is not finished.
constexpr bool isTicking(SceneState state) {
  return state == SceneState::inFlight || state == SceneState::betweenSlices;
}

// Returns whether it has its objects on the device, and can run.
constexpr bool isOnDevice(SceneState state) {
  return state == SceneState::idle || state == SceneState::paused || state == SceneState::running ||
         isTicking(state);
}

// Returns whether a scene may change its state from one to the other.
constexpr bool mayBecome(SceneState from, SceneState to) {
  using enum SceneState;
  switch (from) {
    case asleep:
      return to == loading || to == quarantined;
    case loading:
      return to == prepared || to == idle || to == asleep || to == interrupted || to == refused;
    case prepared:
      return to == idle || to == asleep || to == refused;
    case idle:
    case paused:
      return to == idle || to == paused || to == running || to == interrupted || to == asleep ||
             to == quarantined;
    case running:
      return to == idle || to == paused || to == inFlight || to == interrupted || to == asleep ||
             to == quarantined;
    case inFlight:
      return to == betweenSlices || to == running || to == interrupted;
    case betweenSlices:
      return to == running || to == interrupted || to == asleep || to == quarantined;
    case interrupted:
      return to == loading || to == asleep || to == quarantined;
    case refused:
      return to == quarantined;
    case quarantined:
      return false;
  }
  return false;
}

}  // namespace clothstream::hosting
