// SPDX-License-Identifier: MIT
// The recordings of a server.
#include "server/recording/recordings.h"

#include <stdexcept>

#include <fmt/format.h>
#include <unistd.h>

namespace clothstream::recording {

Recordings::Recordings(RecorderOptions options, bool always) : options_(std::move(options)), always_(always) {
  std::error_code problem;
  std::filesystem::create_directories(options_.directory, problem);
  if (!problem && ::access(options_.directory.c_str(), W_OK | X_OK) != 0)
    problem = std::error_code(errno, std::generic_category());
  if (problem)
    throw std::runtime_error(fmt::format("--record{}: cannot write to {}: {}", always_ ? "" : "ings",
                                         options_.directory.string(), problem.message()));
}

std::shared_ptr<stream::Journal> Recordings::add(const std::string& scene) {
  const std::lock_guard lock(mutex_);
  return journals_.emplace_back(std::make_shared<SceneJournal>(scene, options_, always_));
}

std::string Recordings::report() const {
  const std::lock_guard lock(mutex_);
  RecordingCounts all;
  for (const auto& journal : journals_) {
    const RecordingCounts counts = journal->counts();
    all.running += counts.running;
    all.complete += counts.complete;
    all.failed += counts.failed;
    all.bytes += counts.bytes;
  }
  return fmt::format("recordings\n  running {}  complete {}  failed {}  bytes {}\n", all.running,
                     all.complete, all.failed, all.bytes);
}

}  // namespace clothstream::recording
