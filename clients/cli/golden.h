// SPDX-License-Identifier: MIT
// `clothstream golden`: says which recordings of a folder are no longer simulated as they were.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

struct GoldenOptions {
  std::string directory;
  std::string server;   // clothstream-server; empty: the one next to this program, or in PATH
  std::string device;   // Vulkan device; empty: the server's default
  bool update = false;  // writes golden.json instead of checking
  bool json = false;
  recording::ReadLimits limits{};
};

// Checks every recording, or keeps what the folder has now. SIGINT and SIGTERM must be blocked in every
// thread.
ExitCode golden(const GoldenOptions& options);

}  // namespace clothstream::cli
