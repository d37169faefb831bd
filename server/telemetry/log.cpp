// SPDX-License-Identifier: MIT
// Creates the default logger.
#include "server/telemetry/log.h"

#include <stdexcept>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace clothstream::telemetry {

void setUpLog(const std::string& level) {
  const spdlog::level::level_enum parsed = spdlog::level::from_str(level);
  // from_str() returns `off` for unknown names.
  if (parsed == spdlog::level::off && level != "off")
    throw std::invalid_argument("'" + level +
                                "' is not a log level; use trace, debug, info, warning, error or off");

  // A new logger, instead of a new sink, allows repeated calls in tests.
  auto logger = std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_level(parsed);
  logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace clothstream::telemetry
