// SPDX-License-Identifier: MIT
// The recordings of a server: of each scene while it runs, or when somebody asks.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/recording/scene_journal.h"

namespace clothstream::recording {

// Thread-safe. Ends them all, and waits until they are on the disk.
class Recordings {
 public:
  // `always`: each scene is recorded from when it begins to run; else when somebody asks. Makes the directory
  // where there is none. Throws std::runtime_error with the reason where nothing can be written there.
  Recordings(RecorderOptions options, bool always);

  // Of the scene of this name. Those of scenes that are gone go as well, once they are written.
  std::shared_ptr<scene::Journal> add(const std::string& scene);

  // For people: how many run, are complete, and failed, and their bytes.
  std::string report() const;

 private:
  const RecorderOptions options_;
  const bool always_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<SceneJournal>> journals_;
  RecordingCounts before_;  // of those that are gone
};

}  // namespace clothstream::recording
