// SPDX-License-Identifier: MIT
// Recordings of a server: of every scene while it runs, or on request.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/recording/scene_journal.h"

namespace clothstream::recording {

// Thread-safe. The destructor ends all recordings and waits until they are written.
class Recordings {
 public:
  // `always` records every scene from its start; otherwise scenes are recorded on request. Creates the
  // directory if it does not exist. Throws std::runtime_error with the reason if nothing can be written
  // there.
  Recordings(RecorderOptions options, bool always);

  // Returns the journal of a scene. Removes journals of scenes that no longer exist, once they are written.
  std::shared_ptr<scene::Journal> add(const std::string& scene);

  // Report for people: number of running, complete and failed recordings, and their bytes.
  std::string report() const;

 private:
  const RecorderOptions options_;
  const bool always_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<SceneJournal>> journals_;
  RecordingCounts before_;  // counts of removed journals
};

}  // namespace clothstream::recording
