// SPDX-License-Identifier: MIT
// `clothstream export`: writes the frames of a recording as glTF, as OBJ files or as arrays of numpy.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cli/exit_code.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

struct ExportOptions {
  std::string recording;
  std::string out;             // FILE.glb, FILE.gltf, FILE.npz or a directory for OBJ files; must not exist
  std::optional<double> rate;  // most frames a second; absent: all for .npz, otherwise kDefaultExportRate
  double from = 0;             // seconds of the recording to skip
  std::optional<double> seconds;
  recording::ReadLimits limits{};
};

inline constexpr double kDefaultExportRate = 24;

// Most frames of a glTF file, which is built in memory with one morph target per frame.
inline constexpr std::uint32_t kMaxGltfFrames = 1000;

// SIGINT and SIGTERM must be blocked in every thread; they cancel the command and leave no files.
ExitCode exportFrames(const ExportOptions& options);

}  // namespace clothstream::cli
