// SPDX-License-Identifier: MIT
// Configures spdlog's default logger, which writes lines to standard error. Control characters in a message
// are written as \\xNN.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace clothstream::telemetry {

// json: each line is an object with the time (RFC 3339, UTC), level and message, and with scene and
// participant if the line is about one. It has only ASCII characters.
enum class LogFormat : std::uint8_t { text, json };

// At most `linesPerSecond` lines of each level are written in each second; 0 means no limit. The first line
// after a gap is preceded by one that says how many were left out.
//
// `level` is trace, debug, info, warning, error or off; otherwise throws std::invalid_argument. Lines of text
// are coloured if standard error is a terminal. Every warning and error is flushed at once.
void setUpLog(const std::string& level, LogFormat format = LogFormat::text, double linesPerSecond = 0);

// Lines that were left out since the start of the process.
std::uint64_t omittedLogLines();

// A line of text begins with the name of the scene. Both are fields of a JSON line.
struct LogSubject {
  std::string_view scene;
  std::uint64_t participant = 0;  // 0 means none
};

// Writes one line to the default logger.
void writeLog(const LogSubject& subject, spdlog::level::level_enum level, std::string_view message);

// Logs a message about a scene.
template <typename... Args>
void log(const LogSubject& subject, spdlog::level::level_enum level, fmt::format_string<Args...> format,
         Args&&... args) {
  if (spdlog::should_log(level)) writeLog(subject, level, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace clothstream::telemetry
