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
  // savedAt(), or the time of the first due() while this run has written no checkpoint. The scene loses what
  // happened since then if the server is killed. Nothing if the scene has not run. Any thread.
  virtual std::optional<schedule::Clock::time_point> unsavedSince() const = 0;
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

  // State of a scene that the server starts with. Returns nothing if no state is kept. If the definition has
  // changed, the result has only bans and refused tokens.
  virtual std::optional<SavedScene> take(const model::Scene& start) = 0;
  // Scenes that peers created in earlier runs. Each is returned once. Must be called after take() for all
  // scenes that the server starts with. States of other scenes that a server started with stay on the disk;
  // when room is needed, they are deleted, the oldest first.
  virtual std::vector<SavedScene> takeCreated() = 0;

  // Keeps a scene from now on. The store reads participants, parameters and pauses from the scene. The caller
  // sets LiveScene::keeper to the result. A scene that is destroyed stays kept. Returns null for a scene that
  // the server starts with if a scene of this name that a peer created is kept; that one stays kept.
  virtual std::shared_ptr<SceneKeeper> keep(const std::shared_ptr<LiveScene>& scene) = 0;
  // Forgets a scene, which was deleted.
  virtual void remove(const std::string& name) = 0;
  // Waits until everything of a scene up to this call is on the disk; of all scenes if `name` is empty.
  // Returns false if that fails, or takes longer than `timeout`.
  virtual bool flush(std::chrono::milliseconds timeout, const std::string& name = {}) = 0;

  virtual StoreStatus status() const = 0;
};

}  // namespace clothstream::scene
