// SPDX-License-Identifier: MIT
// `clothstream export`: the frames of a recording for other programs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct ExportOptions {
  std::string recording;
  std::string out;   // FILE.glb, or else a directory for OBJ files; there must be none yet
  double rate = 24;  // frames/s, at most
  double from = 0;   // s of the recording
  std::optional<double> seconds;
};

// glTF has each frame as a morph target and is held in memory: at most so many frames.
inline constexpr std::uint32_t kMaxGltfFrames = 1000;

// SIGINT and SIGTERM must be blocked: then nothing is left.
ExitCode exportFrames(const ExportOptions& options);

}  // namespace clothstream::cli
