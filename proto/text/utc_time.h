// SPDX-License-Identifier: MIT
// Times as text, for programs and people.
#pragma once

#include <chrono>
#include <string>

#include <fmt/chrono.h>

namespace clothstream {

// RFC 3339 in UTC with milliseconds, such as 2026-11-23T20:15:00.125Z.
inline std::string utcTime(std::chrono::system_clock::time_point time) {
  const auto milliseconds = std::chrono::floor<std::chrono::milliseconds>(time);
  const auto seconds = std::chrono::floor<std::chrono::seconds>(milliseconds);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(seconds)),
                     (milliseconds - seconds).count());
}

}  // namespace clothstream
