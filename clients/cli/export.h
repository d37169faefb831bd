// SPDX-License-Identifier: MIT
// `clothstream export`: writes the frames of a recording as glTF or OBJ files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct ExportOptions {
  std::string recording;
  std::string out;   // FILE.glb, FILE.gltf or a directory for OBJ files; must not exist
  double rate = 24;  // most frames a second
  double from = 0;   // seconds of the recording to skip
  std::optional<double> seconds;
};

// Most frames of a glTF file, which is built in memory with one morph target per frame.
inline constexpr std::uint32_t kMaxGltfFrames = 1000;

// SIGINT and SIGTERM must be blocked in every thread; they cancel the command and leave no files.
ExitCode exportFrames(const ExportOptions& options);

}  // namespace clothstream::cli
