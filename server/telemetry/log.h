// SPDX-License-Identifier: MIT
// Configures spdlog's default logger, which writes lines to standard error. Control characters in a message
// are written as \\xNN.
#pragma once

#include <string>

namespace clothstream::telemetry {

// `level` is trace, debug, info, warning, error or off; otherwise throws std::invalid_argument. Lines are
// coloured if standard error is a terminal. Every warning and error is flushed at once.
void setUpLog(const std::string& level);

}  // namespace clothstream::telemetry
