// SPDX-License-Identifier: MIT
// Creates the default logger.
#include "server/telemetry/log.h"

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "proto/text/printable.h"
#include "proto/text/utc_time.h"

namespace clothstream::telemetry {
namespace {

// Subject of the line that this thread writes. Sinks format a line on the thread that logs it.
thread_local LogSubject subjectOfThread;

// The text of a log line. Names and texts from clients cannot forge lines or control the terminal.
class PrintableText final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& line) override {
    if (!subjectOfThread.scene.empty()) append(line, printable(subjectOfThread.scene) + ": ");
    append(line, printable({message.payload.data(), message.payload.size()}));
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return spdlog::details::make_unique<PrintableText>();
  }

 private:
  static void append(spdlog::memory_buf_t& line, const std::string& text) {
    line.append(text.data(), text.data() + text.size());
  }
};

class JsonLine final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    const spdlog::string_view_t level = spdlog::level::to_string_view(message.level);
    nlohmann::ordered_json object{{"time", utcTime(message.time)},
                                  {"level", std::string(level.data(), level.size())},
                                  {"message", printable({message.payload.data(), message.payload.size()})}};
    if (!subjectOfThread.scene.empty()) object["scene"] = printable(subjectOfThread.scene);
    if (subjectOfThread.participant != 0) object["participant"] = subjectOfThread.participant;
    // Other characters than ASCII are escaped, and invalid UTF-8 is replaced.
    const std::string text =
        object.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + '\n';
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return spdlog::details::make_unique<JsonLine>();
  }
};

std::atomic<std::uint64_t> omittedLines{0};

// Writes a limited number of lines of each level in each second. A flood of one level hides no other.
class LimitedSink final : public spdlog::sinks::sink {
 public:
  LimitedSink(std::shared_ptr<spdlog::sinks::sink> to, double linesPerSecond)
      : to_(std::move(to)), limit_(linesPerSecond) {}

  void log(const spdlog::details::log_msg& message) override {
    std::uint64_t omitted = 0;
    {
      const std::lock_guard lock(mutex_);
      Level& level = levels_.at(static_cast<std::size_t>(message.level));
      const auto second = std::chrono::floor<std::chrono::seconds>(message.time);
      if (second != level.second) {
        level.second = second;
        level.lines = 0;
      }
      if (limit_ > 0 && ++level.lines > limit_) {
        ++level.omitted;
        ++omittedLines;
        return;
      }
      omitted = std::exchange(level.omitted, 0);
    }
    if (omitted > 0) sayOmitted(message, omitted);
    to_->log(message);
  }
  void flush() override { to_->flush(); }
  void set_pattern(const std::string& pattern) override { to_->set_pattern(pattern); }
  void set_formatter(std::unique_ptr<spdlog::formatter> formatter) override {
    to_->set_formatter(std::move(formatter));
  }

 private:
  struct Level {
    std::chrono::sys_seconds second{};
    double lines = 0;  // in this second, omitted ones included
    std::uint64_t omitted = 0;
  };

  void sayOmitted(const spdlog::details::log_msg& before, std::uint64_t lines) {
    const LogSubject subject = std::exchange(subjectOfThread, {});
    const std::string text = fmt::format("{} lines were left out here (--profile)", lines);
    to_->log(spdlog::details::log_msg(before.time, {}, before.logger_name, before.level, text));
    subjectOfThread = subject;
  }

  const std::shared_ptr<spdlog::sinks::sink> to_;
  const double limit_;
  std::mutex mutex_;
  std::array<Level, spdlog::level::n_levels> levels_;
};

}  // namespace

std::uint64_t omittedLogLines() {
  return omittedLines;
}

void setUpLog(const std::string& level, LogFormat format, double linesPerSecond) {
  const spdlog::level::level_enum parsed = spdlog::level::from_str(level);
  // from_str() returns `off` for unknown names.
  if (parsed == spdlog::level::off && level != "off")
    throw std::invalid_argument("'" + level +
                                "' is not a log level; use trace, debug, info, warning, error or off");

  // A new logger, instead of a new sink, allows repeated calls in tests.
  auto logger = std::make_shared<spdlog::logger>(
      "",
      std::make_shared<LimitedSink>(std::make_shared<spdlog::sinks::stderr_color_sink_mt>(), linesPerSecond));
  logger->set_level(parsed);
  if (format == LogFormat::json) {
    logger->set_formatter(std::make_unique<JsonLine>());
  } else {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<PrintableText>('V').set_pattern("%H:%M:%S.%e %^%l%$ %V");
    logger->set_formatter(std::move(formatter));
  }
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
}

void writeLog(const LogSubject& subject, spdlog::level::level_enum level, std::string_view message) {
  subjectOfThread = subject;
  spdlog::log(level, spdlog::string_view_t(message.data(), message.size()));
  subjectOfThread = {};
}

}  // namespace clothstream::telemetry
