// SPDX-License-Identifier: MIT
// Signals that end the program. The program waits for them instead of handling them.
#pragma once

#include <chrono>

namespace clothstream::cli {

// Blocks SIGINT and SIGTERM. Call it before any thread starts, so that all inherit it.
void blockEndingSignals();

// Waits for one of the signals. Returns false if none arrived within the time.
bool interrupted(std::chrono::milliseconds time = {});

}  // namespace clothstream::cli
