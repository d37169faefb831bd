// SPDX-License-Identifier: MIT
#include "server/program/guards.h"

#include <cstdlib>
#include <stop_token>

#include <spdlog/spdlog.h>
#include <unistd.h>

namespace clothstream::program {
namespace {

// Interval in which the guards look for signals.
constexpr std::chrono::milliseconds kGuardInterval{20};
constexpr unsigned kLogSeconds = 1;  // for the last line of the log

// Ends the process. The kernel closes files and connections; recordings stay readable.
[[noreturn]] void endNow(const char* why) {
  // The log may be a pipe that is full. SIGALRM then ends the process.
  ::alarm(kLogSeconds);
  spdlog::error("ending at once: {}", why);
  spdlog::default_logger()->flush();
  std::_Exit(1);
}

// SIGALRM ends the process soon after this time, even if the guard itself is blocked by a log that nobody
// reads.
void endAtLatest(std::chrono::nanoseconds time) {
  ::alarm(static_cast<unsigned>(std::chrono::ceil<std::chrono::seconds>(time).count()) + kLogSeconds);
}

}  // namespace

StartGuard::StartGuard(const Signals& signals, std::chrono::nanoseconds drain)
    : thread_([this, &signals, drain](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          const bool signalled = signals.waitForEnd(kGuardInterval);
          if (signalled && stopAt_) endNow("another signal came");
          if (signalled) {
            endAtLatest(drain);
            spdlog::info("stopping when the start is complete, or after {} s (--drain)",
                         std::chrono::duration<double>(drain).count());
            stopAt_ = std::chrono::steady_clock::now() + drain;
          }
          if (stopAt_ && std::chrono::steady_clock::now() >= *stopAt_) endNow("the start takes too long");
        }
      }) {}

std::optional<SteadyTime> StartGuard::finish() {
  thread_ = {};
  return stopAt_;
}

EndGuard::EndGuard(const Signals& signals, SteadyTime end)
    : thread_([&signals, end](const std::stop_token& stop) {
        while (std::chrono::steady_clock::now() < end && !stop.stop_requested())
          if (signals.waitForEnd(kGuardInterval)) endNow("another signal came");
        if (!stop.stop_requested()) endNow("the device or the disk does not answer");
      }) {}

}  // namespace clothstream::program
