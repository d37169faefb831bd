// SPDX-License-Identifier: MIT
// Interfaces of what learns who joins and leaves scenes, and what scenes use; server/events implements them.
#pragma once

#include <cstdint>
#include <memory>

#include "server/scene/subject.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

class LiveScene;
struct Participant;

// Observes one scene. It is destroyed when nobody uses the scene any more; the metrics of the scene are then
// complete. Calls are made under the lock of the roster, so they must not block. They must not throw.
class SceneObserver {
 public:
  virtual ~SceneObserver() = default;

  // A participant is new. One that comes back within its grace period is not.
  virtual void joined(const Participant& participant, const Subject& subject) = 0;
  // A participant left for good. `connected`: time for which it was connected in this run of the server.
  virtual void left(const Participant& participant, const Subject& subject,
                    schedule::Clock::duration connected) = 0;
};

// Numbers for operators: events for a backend.
struct ObserverStatus {
  std::uint64_t delivered = 0;
  std::uint64_t retried = 0;  // attempts that failed and are repeated
  std::uint64_t dropped = 0;
};

// Observes the scenes of a server. Thread-safe.
class Observer {
 public:
  virtual ~Observer() = default;

  // The scene outlives the result.
  virtual std::unique_ptr<SceneObserver> observe(const LiveScene& scene) = 0;
  virtual ObserverStatus status() const = 0;
};

}  // namespace clothstream::scene
