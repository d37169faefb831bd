// SPDX-License-Identifier: MIT
// The log: lines on standard error through spdlog's default logger.
#pragma once

#include <string>

namespace clothstream::telemetry {

// `level` is one of trace, debug, info, warning, error, off. Throws std::invalid_argument that names them
// otherwise. Colours where standard error is a terminal. Flushed at every warning.
void setUpLog(const std::string& level);

}  // namespace clothstream::telemetry
