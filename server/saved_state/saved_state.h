// SPDX-License-Identifier: MIT
// Keeps the scenes of a server in a directory, so that they survive its end (docs/state.md).
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clothstream/v1/scene.pb.h"
#include "server/saved_state/database.h"
#include "server/saved_state/earlier_scenes.h"
#include "server/saved_state/flush_requests.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_store.h"

namespace clothstream::saved_state {

struct SavedStateOptions {
  std::filesystem::path directory = {};  // the database is in DIRECTORY/scenes
  // Limit of the database in bytes; checkpoints of the largest scenes are left out beyond it. 0: no limit.
  std::uint64_t maxBytes = 1'000'000'000;
  // Free space of the disk below which no checkpoint is written.
  std::uint64_t minFreeBytes = 0;
  // Called by the writer before it looks at a scene of this name. For tests.
  std::function<void(const std::string&)> beforeWrite = {};
  // Interval of the checkpoints of a running scene, and interval at which participants and parameters are
  // checked for changes. A checkpoint is thus at most 5 s old while a write takes less than 1.5 s.
  std::chrono::milliseconds checkpointInterval{3000}, lookInterval{500};
};

// Thread-safe. One thread writes. At most one checkpoint of each scene waits for it: the newest.
class SavedState final : public scene::SceneStore {
 public:
  // Opens the database and reads its scenes. A damaged row costs only its scene, and is logged. Throws what
  // Database throws.
  explicit SavedState(SavedStateOptions options);
  // Writes everything that waits. The scenes may have been destroyed before.
  ~SavedState() override;
  SavedState(const SavedState&) = delete;
  SavedState& operator=(const SavedState&) = delete;

  std::vector<scene::SavedScene> takeCreated() override;
  std::optional<scene::SavedScene> take(const model::Scene& start) override;
  std::shared_ptr<scene::SceneKeeper> keep(const std::shared_ptr<scene::LiveScene>& scene) override;
  void remove(const std::string& name) override;
  bool flush(std::chrono::milliseconds timeout, const std::string& name = {}) override;
  scene::StoreStatus status() const override;

 private:
  class CheckpointSlot;
  struct Taken {
    scene::Checkpoint checkpoint;
    schedule::Clock::time_point at;
  };
  // Belongs to the writer, except for the constant members.
  struct KeptScene {
    KeptScene(const std::shared_ptr<scene::LiveScene>& live, std::shared_ptr<CheckpointSlot> checkpoints,
              bool exists)
        : created(live->terms.created), scene(live), slot(std::move(checkpoints)), hasRow(exists) {}
    const bool created;
    const std::weak_ptr<scene::LiveScene> scene;
    const std::shared_ptr<CheckpointSlot> slot;
    bool hasRow;                           // the database has the scene
    std::optional<std::uint64_t> version;  // of the parameters in `parameters`
    v1::Scene parameters;
    bool hasSession = false;  // participants, bans, refused tokens, or a pause
    std::string session;      // on the disk
    // Read from the scene, and not on the disk yet.
    std::optional<std::string> waitingSession;
  };
  using KeptScenes = std::map<std::string, std::shared_ptr<KeptScene>>;

  void run();
  // Writes everything that waits.
  void pass();
  void saveScene(const std::string& name, KeptScene& kept);
  // Writes what differs from the database. Returns false if that fails.
  bool write(const std::string& name, KeptScene& kept, const std::optional<Taken>& checkpoint);
  // Serialises the session if it has changed.
  static void readSession(KeptScene& kept);
  // Makes room for a scene whose checkpoint has `checkpoint` bytes, and definition and session `rest`.
  // Deletes states of scenes that are not in use, then checkpoints of larger scenes. Returns false if that is
  // not enough, or if this scene is among the largest.
  bool makeRoom(const std::string& name, std::uint64_t rest, std::uint64_t checkpoint);
  // Removes the checkpoint of this scene. Returns false if that fails.
  bool leaveOut(const std::string& name);
  // Deletes the oldest state of a scene that is not in use. Returns false if there is no such state.
  bool dropOldestUnused();
  // Sets diskIsFull_.
  void findFreeSpace();
  // Counts a write. Returns whether it succeeded.
  bool recordResult(const std::string& name, const Database::Done& done);
  // A scene that failed is tried again later. The first failure is logged.
  void recordFailure(const std::string& name, const std::string& why);
  void recordSuccess(const std::string& name);

  const SavedStateOptions options_;

  mutable std::mutex mutex_;  // protects the members down to stopping_
  std::condition_variable changed_, written_;
  KeptScenes kept_;
  EarlierScenes earlier_;
  std::set<std::string> removed_;   // since the newest pass
  std::size_t failedRemovals_ = 0;  // at the end of the newest pass
  FlushRequests flushes_;
  // Scenes whose newest write failed, with the time of the next one.
  std::map<std::string, schedule::Clock::time_point> retryAt_;
  scene::StoreStatus status_;
  bool stopping_ = false;

  // Belong to the writer after construction.
  Database database_;
  std::map<std::string, Database::Row> rows_;
  std::set<std::string> toRemove_;  // removed scenes that the database still has
  std::set<std::string> leftOut_;
  bool logsNextFailure_ = true;  // of a whole pass
  bool diskIsFull_ = false;      // at the newest check

  std::thread thread_;
};

}  // namespace clothstream::saved_state
