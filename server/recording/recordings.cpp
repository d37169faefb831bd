// SPDX-License-Identifier: MIT
// The recordings of a server.
#include "server/recording/recordings.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <unistd.h>

namespace clothstream::recording {

Recordings::Recordings(RecorderOptions options) : options_(std::move(options)) {
  std::error_code problem;
  std::filesystem::create_directories(options_.directory, problem);
  if (!problem && ::access(options_.directory.c_str(), W_OK | X_OK) != 0)
    problem = std::error_code(errno, std::generic_category());
  if (problem)
    throw std::runtime_error(
        fmt::format("--record: cannot write to {}: {}", options_.directory.string(), problem.message()));
}

std::shared_ptr<stream::Journal> Recordings::add() {
  const std::lock_guard lock(mutex_);
  return recorders_.emplace_back(std::make_shared<Recorder>(options_));
}

std::string Recordings::report() const {
  const std::lock_guard lock(mutex_);
  const auto count = [&](Recorder::State state) {
    return std::ranges::count(recorders_, state, [](const auto& recorder) { return recorder->state(); });
  };
  std::uint64_t bytes = 0;
  for (const auto& recorder : recorders_) bytes += recorder->bytes();
  return fmt::format("recordings\n  running {}  complete {}  failed {}  bytes {}\n",
                     count(Recorder::State::running), count(Recorder::State::complete),
                     count(Recorder::State::failed), bytes);
}

}  // namespace clothstream::recording
