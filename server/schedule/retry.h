// SPDX-License-Identifier: MIT
// Repeats work that must succeed while memory is short.
#pragma once

#include <chrono>
#include <exception>
#include <thread>

namespace clothstream::schedule {

// Pause between two attempts.
inline constexpr std::chrono::milliseconds kRetryPause{20};

// Runs `work` until it ends without an exception. Calls `failed` with each exception, and then waits for
// kRetryPause. `failed` may throw, for example because its log line needs memory; that is ignored.
template <class Work, class Failed>
void retryUntilDone(const Work& work, const Failed& failed) {
  for (;;) {
    try {
      return work();
    } catch (const std::exception& failure) {
      try {
        failed(failure);
      } catch (const std::exception&) {
      }
    }
    std::this_thread::sleep_for(kRetryPause);
  }
}

}  // namespace clothstream::schedule
