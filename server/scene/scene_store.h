// SPDX-License-Identifier: MIT
// Interface of what keeps scenes beyond the end of the server, which server/saved_state implements.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scene/checkpoint.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

class LiveScene;

// Takes the checkpoints of one scene. No function blocks.
class SceneKeeper {
 public:
  virtual ~SceneKeeper() = default;

  // The following two belong to the device's thread. Returns whether the tick that begins now should end with
  // save().
  virtual bool due(schedule::Clock::time_point now) = 0;
  virtual void save(Checkpoint checkpoint) = 0;

  // Time at which the newest checkpoint that is on the disk was taken; nothing if this run wrote none. Any
  // thread.
  virtual std::optional<schedule::Clock::time_point> savedAt() const = 0;
};

// Numbers for operators.
struct StoreStatus {
  std::uint64_t bytes = 0;         // size of the files
  std::size_t waiting = 0;         // scenes with a checkpoint or a removal that is not on the disk yet
  std::uint64_t writes = 0;        // transactions since the start
  std::uint64_t failedWrites = 0;  // the same, refused by the disk or for lack of room
  std::size_t leftOut = 0;         // scenes whose checkpoints have no room
};

// Thread-safe.
class SceneStore {
 public:
  virtual ~SceneStore() = default;

  // Scenes that peers created in earlier runs. Each is returned once.
  virtual std::vector<SavedScene> takeCreated() = 0;
  // State of a scene that the server starts with. Returns nothing if no state is kept, or if the definition
  // has changed.
  virtual std::optional<SavedScene> take(const model::Scene& start) = 0;

  // Keeps a scene from now on. Participants, parameters and pauses are looked at by themselves; the caller
  // gives the keeper to the scene. A scene that is destroyed stays kept.
  virtual std::shared_ptr<SceneKeeper> keep(const std::shared_ptr<LiveScene>& scene) = 0;
  // Forgets a scene, which was deleted.
  virtual void remove(const std::string& name) = 0;
  // Waits until everything up to this call is on the disk. Returns false if that fails, or takes longer than
  // `timeout`.
  virtual bool flush(std::chrono::milliseconds timeout) = 0;

  virtual StoreStatus status() const = 0;
};

}  // namespace clothstream::scene
