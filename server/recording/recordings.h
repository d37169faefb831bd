// SPDX-License-Identifier: MIT
// The recordings of a server: one for each scene that ran.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/recording/recorder.h"

namespace clothstream::recording {

// Thread-safe. Ends them all, and waits until they are on the disk.
class Recordings {
 public:
  // Makes the directory where there is none. Throws std::runtime_error with the reason where nothing can be
  // written there.
  explicit Recordings(RecorderOptions options);

  std::shared_ptr<stream::Journal> add();

  // For people: how many run, are complete, and failed, and their bytes.
  std::string report() const;

 private:
  const RecorderOptions options_;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<Recorder>> recorders_;
};

}  // namespace clothstream::recording
