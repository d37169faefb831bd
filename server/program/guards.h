// SPDX-License-Identifier: MIT
// Limits on the time that the process may take to start and to end after a signal.
#pragma once

#include <chrono>
#include <optional>
#include <thread>

#include "server/program/signals.h"

namespace clothstream::program {

using SteadyTime = std::chrono::steady_clock::time_point;

// Takes SIGINT and SIGTERM while the server starts. Ends the process if the start goes on for `drain` after
// the first of them, or at the second one.
class StartGuard {
 public:
  StartGuard(const Signals& signals, std::chrono::nanoseconds drain);

  // Call it when the start is complete. Returns when the process must have ended, if SIGINT or SIGTERM came.
  std::optional<SteadyTime> finish();

 private:
  std::optional<SteadyTime> stopAt_;  // belongs to the thread until finish()
  std::jthread thread_;
};

// Ends the process while it lives: when the time is over, or at the next SIGINT or SIGTERM.
class EndGuard {
 public:
  EndGuard(const Signals& signals, SteadyTime end);

 private:
  std::jthread thread_;
};

}  // namespace clothstream::program
