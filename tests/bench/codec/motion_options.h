// SPDX-License-Identifier: MIT
// The options of what codecs are measured on.
#pragma once

#include <CLI/CLI.hpp>

#include "tests/bench/suite.h"

namespace clothstream::bench {

// Both outlive the parsing.
void addMotionOptions(CLI::App& app, Settings& settings);

}  // namespace clothstream::bench
