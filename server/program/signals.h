// SPDX-License-Identifier: MIT
// Signals of the process, taken by the threads that wait for them.
#pragma once

#include <chrono>
#include <csignal>

namespace clothstream::program {

// Blocks SIGINT, SIGTERM, SIGHUP, SIGUSR1 and SIGUSR2 in every thread; wait() takes them. Must be created
// before any other thread.
class Signals {
 public:
  Signals();

  // Returns the next signal.
  int wait() const;
  // Returns the next signal, or 0 after `timeout`.
  int wait(std::chrono::nanoseconds timeout) const;
  // Returns whether SIGINT or SIGTERM came within `timeout`. Leaves other signals for wait().
  bool waitForEnd(std::chrono::nanoseconds timeout) const;
  // Takes the next signal without waiting. Returns whether it is SIGINT or SIGTERM.
  bool interrupted() const;

 private:
  sigset_t set_{}, ending_{};
};

}  // namespace clothstream::program
