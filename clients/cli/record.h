// SPDX-License-Identifier: MIT
// `clothstream record`: writes a live stream to a file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cli/exit_code.h"
#include "clients/native/address.h"

namespace clothstream::cli {

struct RecordOptions {
  ServerAddress address = std::string(kDefaultAddress);
  std::string scene;  // empty: the server's default scene
  std::string output;
  std::uint32_t maxVertices = 0;  // 0: the default of cs_limits
  std::optional<double> seconds;  // not set: until a signal
  bool fullQuality = false;       // ends at the first frame that is coarser than quality 0
  std::string program;            // name and version of this program
};

// SIGINT and SIGTERM must be blocked in every thread; they end the recording like its time limit, and the
// file is complete.
ExitCode record(const RecordOptions& options);

}  // namespace clothstream::cli
