// SPDX-License-Identifier: MIT
// Sets spdlog's default logger up.
#include "server/telemetry/log.h"

#include <stdexcept>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace clothstream::telemetry {

void setUpLog(const std::string& level) {
  const spdlog::level::level_enum parsed = spdlog::level::from_str(level);
  // from_str answers `off` to what it does not know.
  if (parsed == spdlog::level::off && level != "off")
    throw std::invalid_argument("log level '" + level +
                                "' is none of trace, debug, info, warning, error, off");

  // Replacing the logger, not its sink, lets tests do it more than once.
  auto logger = std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_level(parsed);
  logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace clothstream::telemetry
