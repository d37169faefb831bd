// SPDX-License-Identifier: MIT
// Work that signals ask for, such as reading certificates again, away from the thread that waits for signals.
#pragma once

#include <chrono>
#include <functional>
#include <memory>

namespace clothstream::program {

// Has one thread for all work. Reading a file of a disk that does not answer, and printing into a pipe that
// is full, may block this thread for ever; then the process still ends. Belongs to one thread.
class SignalWork {
 public:
  // Time for which the destructor waits for work that runs.
  static constexpr std::chrono::seconds kPatience{1};

  SignalWork();
  // Drops the work that waits. Leaves work that blocks to its thread, which may outlive this.
  ~SignalWork();
  SignalWork(const SignalWork&) = delete;
  SignalWork& operator=(const SignalWork&) = delete;

  // Runs `work` soon, instead of work for the same signal that still waits. It must own everything that it
  // uses. An exception is logged.
  void post(int signal, std::function<void()> work);

 private:
  struct State;
  const std::shared_ptr<State> state_;  // shared with the thread
};

}  // namespace clothstream::program
