// SPDX-License-Identifier: MIT
// Keeps the scenes of a server in a directory, so that they survive its end (docs/state.md).
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
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
#include "server/scene/live_scene.h"
#include "server/scene/scene_store.h"

namespace clothstream::saved_state {

struct SavedStateOptions {
  std::filesystem::path directory = {};  // the database is in DIRECTORY/scenes
  // Limit of the database in bytes; checkpoints of the largest scenes are left out beyond it. 0: no limit.
  std::uint64_t maxBytes = 1'000'000'000;
  // Free space of the disk below which no checkpoint is written.
  std::uint64_t minFreeBytes = 0;
  // Interval of the checkpoints of a running scene, and interval at which participants and parameters are
  // looked at. A checkpoint is thus at most 5 s old while a write takes less than 1.5 s.
  std::chrono::milliseconds checkpointInterval{3000}, lookInterval{500};
};

// Thread-safe. One thread writes. What waits for it is bounded: one checkpoint of each scene, of which the
// newest counts.
class SavedState final : public scene::SceneStore {
 public:
  // Opens the database and reads its scenes. A damaged row costs only its scene, and is logged. Throws what
  // Database throws.
  explicit SavedState(SavedStateOptions options);
  // Writes what waits. The scenes may have been destroyed before.
  ~SavedState() override;
  SavedState(const SavedState&) = delete;
  SavedState& operator=(const SavedState&) = delete;

  std::vector<scene::SavedScene> takeCreated() override;
  std::optional<scene::SavedScene> take(const model::Scene& start) override;
  std::shared_ptr<scene::SceneKeeper> keep(const std::shared_ptr<scene::LiveScene>& scene) override;
  void remove(const std::string& name) override;
  bool flush(std::chrono::milliseconds timeout) override;
  scene::StoreStatus status() const override;

 private:
  class Keeper;
  // A scene that is kept. Belongs to the writer, except for the constant members.
  struct Kept {
    Kept(const std::shared_ptr<scene::LiveScene>& live, std::shared_ptr<Keeper> taker, bool exists)
        : created(live->created), scene(live), keeper(std::move(taker)), hasRow(exists) {}
    const bool created;
    const std::weak_ptr<scene::LiveScene> scene;
    const std::shared_ptr<Keeper> keeper;
    bool hasRow;                           // the database has the scene
    std::optional<std::uint64_t> version;  // of the parameters in `parameters`
    v1::Scene parameters;
    std::string session;  // on the disk
    // Read from the scene, and not on the disk yet.
    std::optional<std::string> waitingSession;
  };
  using Names = std::map<std::string, std::shared_ptr<Kept>>;

  void run();
  // Writes everything that waits. Returns false if a write failed.
  bool pass();
  bool write(const std::string& name, Kept& kept);
  // Serialises the session if it has changed.
  static void look(Kept& kept);
  // Removes checkpoints of larger scenes until one of `bytes` has room. Returns false if this scene is among
  // the largest.
  bool makeRoom(const std::string& name, std::uint64_t bytes);
  bool diskHasRoom();
  // Logs the first failure of a row of failures.
  bool note(const std::string& name, const Database::Done& done);

  const SavedStateOptions options_;

  mutable std::mutex mutex_;  // protects the members down to stopping_
  std::condition_variable changed_, written_;
  Names kept_;
  std::set<std::string> restored_;  // scenes that were taken
  std::set<std::string> removed_;   // since the newest pass
  std::uint64_t asked_ = 0;         // calls of flush()
  std::uint64_t done_ = 0;          // those that a pass has served
  bool failed_ = false;             // the newest pass
  scene::StoreStatus status_;
  bool stopping_ = false;
  std::vector<scene::SavedScene> created_;         // until taken
  std::map<std::string, SceneContents> ofServer_;  // scenes that the server starts with, until taken

  // Belong to the writer after construction.
  Database database_;
  std::map<std::string, Database::Row> rows_;
  std::set<std::string> leftOut_;
  bool complains_ = true;    // the next failure is logged
  bool diskIsFull_ = false;  // at the newest look

  std::thread thread_;
};

}  // namespace clothstream::saved_state
