// SPDX-License-Identifier: MIT
// `clothstream decode`: decodes a stream file to a motion file.
#pragma once

#include <cstdint>
#include <string>

#include "clients/cli/exit_code.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::cli {

struct DecodeOptions {
  std::string recording, out;
  // Larger recordings are refused. A vertex needs about 400 bytes of memory.
  std::uint32_t maxVertices = codec::kDefaultMaxVertices;
};

// Writes positions as a client decodes them and normals computed from them. SIGINT and SIGTERM must be
// blocked in every thread; they cancel the command and leave no file.
ExitCode decode(const DecodeOptions& options);

}  // namespace clothstream::cli
