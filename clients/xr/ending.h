// SPDX-License-Identifier: MIT
// SIGINT and SIGTERM, which end the program.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace clothstream::xr {

// After the first signal, the program has kLongest to end by itself. Then, or at a second signal, this class
// stops it: a runtime or a driver may never return from a call. At most one object exists.
class Ending {
 public:
  static constexpr std::chrono::seconds kLongest{10};

  // Blocks both signals. Make it before all other threads, so that they inherit this.
  Ending();
  ~Ending();
  Ending(const Ending&) = delete;
  Ending& operator=(const Ending&) = delete;

  // Whether a signal has arrived.
  bool isWanted() const { return isWanted_; }
  // Waits for a signal, at most for this time. Returns whether one has arrived.
  bool wait(std::chrono::milliseconds time);

 private:
  void watch();

  std::atomic<bool> isWanted_ = false, isOver_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;
};

}  // namespace clothstream::xr
