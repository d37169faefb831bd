// SPDX-License-Identifier: MIT
// Command-line options that choose motions for codecs.
#pragma once

#include <CLI/CLI.hpp>

#include "tests/bench/suite.h"

namespace clothstream::bench {

// `app` and `settings` must live until the command line is parsed.
void addMotionOptions(CLI::App& app, Settings& settings);

}  // namespace clothstream::bench
