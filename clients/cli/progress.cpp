// SPDX-License-Identifier: MIT
#include "clients/cli/progress.h"

#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include "clients/cli/print.h"

namespace clothstream::cli {

Progress::Progress(const char* what, std::uint32_t frames)
    : what_(what), frames_(frames), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (shown_) showStatus(stderr, "");
}

void Progress::show(std::uint32_t frame) {
  if (!terminal_ || SteadyClock::now() < next_) return;
  showStatus(stderr,
             fmt::format("{}: frame {} of {}, {:.0f} %", what_, frame, frames_, 100.0 * frame / frames_));
  shown_ = true;
  next_ = SteadyClock::now() + std::chrono::milliseconds(100);
}

}  // namespace clothstream::cli
