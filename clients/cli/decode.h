// SPDX-License-Identifier: MIT
// `clothstream decode`: a recorded stream becomes a motion again.
#pragma once

#include <cstdint>
#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct DecodeOptions {
  std::string recording, out;
  // What the recording may ask for; a vertex takes some 400 bytes of memory.
  std::uint32_t maxVertices = 1u << 20;
};

// Positions as every client of the stream has them, and the normals that it computes from them. SIGINT and
// SIGTERM must be blocked: then there is no file.
ExitCode decode(const DecodeOptions& options);

}  // namespace clothstream::cli
