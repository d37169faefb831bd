// SPDX-License-Identifier: MIT
// Creates the journals of a server's scenes.
#include "server/recording/recordings.h"

#include <cerrno>
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

std::shared_ptr<scene::Journal> Recordings::add(const std::string& scene) {
  const std::lock_guard lock(mutex_);
  std::erase_if(journals_, [&](const auto& journal) {
    if (journal.use_count() > 1) return false;
    const RecordingCounts counts = journal->counts();
    if (counts.running > 0) return false;
    before_ += counts;
    return true;
  });
  return journals_.emplace_back(std::make_shared<SceneJournal>(scene, options_, always_));
}

std::string Recordings::report() const {
  const std::lock_guard lock(mutex_);
  RecordingCounts all = before_;
  for (const auto& journal : journals_) all += journal->counts();
  return fmt::format("recordings\n  running {}  complete {}  failed {}  bytes {}\n", all.running,
                     all.complete, all.failed, all.bytes);
}

}  // namespace clothstream::recording
