// SPDX-License-Identifier: MIT
#include "clients/cli/progress.h"

#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

namespace clothstream::cli {

Progress::Progress(const char* what, std::uint32_t frames)
    : what_(what), frames_(frames), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\r\033[K");
}

void Progress::show(std::uint32_t frame) {
  if (!terminal_ || SteadyClock::now() < next_) return;
  fmt::print(stderr, "\r\033[K{}: frame {} of {}, {:.0f} %", what_, frame, frames_, 100.0 * frame / frames_);
  std::fflush(stderr);
  shown_ = true;
  next_ = SteadyClock::now() + std::chrono::milliseconds(100);
}

}  // namespace clothstream::cli
