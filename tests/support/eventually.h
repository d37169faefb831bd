// SPDX-License-Identifier: MIT
// Waits for what other threads and programs do.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace clothstream::tests {

// Polls until `holds` returns true. Returns false after a minute, which is enough for sanitizers, validation
// and software Vulkan on a busy machine.
inline bool eventually(const std::function<bool()>& holds) {
  using Clock = std::chrono::steady_clock;
  for (const auto end = Clock::now() + std::chrono::minutes(1); Clock::now() < end;
       std::this_thread::sleep_for(std::chrono::milliseconds(5)))
    if (holds()) return true;
  return false;
}

}  // namespace clothstream::tests
