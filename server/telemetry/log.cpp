// SPDX-License-Identifier: MIT
// Creates the default logger.
#include "server/telemetry/log.h"

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "proto/text/printable.h"

namespace clothstream::telemetry {
namespace {

// The text of a log line. Names and texts from clients cannot forge lines or control the terminal.
class PrintableText final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& line) override {
    const std::string text = printable({message.payload.data(), message.payload.size()});
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return spdlog::details::make_unique<PrintableText>();
  }
};

}  // namespace

void setUpLog(const std::string& level) {
  const spdlog::level::level_enum parsed = spdlog::level::from_str(level);
  // from_str() returns `off` for unknown names.
  if (parsed == spdlog::level::off && level != "off")
    throw std::invalid_argument("'" + level +
                                "' is not a log level; use trace, debug, info, warning, error or off");

  // A new logger, instead of a new sink, allows repeated calls in tests.
  auto logger = std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_level(parsed);
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableText>('V').set_pattern("%H:%M:%S.%e %^%l%$ %V");
  logger->set_formatter(std::move(formatter));
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace clothstream::telemetry
