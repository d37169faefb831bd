// SPDX-License-Identifier: MIT
// How far something long is.
#pragma once

#include <chrono>
#include <cstdint>

namespace clothstream::cli {

// A line on standard error where that is a terminal, from the second second on; gone with the object.
class Progress {
 public:
  Progress(const char* what, std::uint32_t frames);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(std::uint32_t frame);

 private:
  using SteadyClock = std::chrono::steady_clock;

  const char* what_;
  std::uint32_t frames_;
  bool terminal_, shown_ = false;
  SteadyClock::time_point next_ = SteadyClock::now() + std::chrono::seconds(1);
};

}  // namespace clothstream::cli
