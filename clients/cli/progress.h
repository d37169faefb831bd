// SPDX-License-Identifier: MIT
// Progress line of a long command.
#pragma once

#include <chrono>
#include <cstdint>

namespace clothstream::cli {

// Shows a line on standard error after 1 s if that is a terminal. The destructor clears it.
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
