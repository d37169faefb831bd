// SPDX-License-Identifier: MIT
// Signals that end the program are waited for, never handled.
#pragma once

#include <chrono>

namespace clothstream::cli {

// SIGINT and SIGTERM. Before any thread starts, so that all inherit it.
void blockEndingSignals();

// True if one of them came within the time.
bool interrupted(std::chrono::milliseconds time = {});

}  // namespace clothstream::cli
