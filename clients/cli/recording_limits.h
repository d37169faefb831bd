// SPDX-License-Identifier: MIT
// What the commands that read recordings have in common: their limits, and the error for a damaged one.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "clients/cli/error.h"
#include "clients/recording/played_recording.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

// Adds --max-vertices.
inline void addLimits(CLI::App& command, recording::ReadLimits& limits) {
  command
      .add_option("--max-vertices", limits.vertices,
                  "Most vertices of a recording, and half of its most triangles, since the file decides how "
                  "much memory is needed")
      ->check(CLI::Range(1u, codec::kMaxVertices))
      ->capture_default_str();
}

// Error for a recording with a part that cannot be read or decoded. Reads the rest of it, so that the text
// counts every frame.
inline Error damageOf(client::PlayedRecording& played, const std::string& path, const std::string& problem) {
  static_cast<void>(played.readToTheEnd());
  const std::string all = played.faults().text();
  return {kUnreadable, fmt::format("{} is damaged: {}{}{}; clothstream recover {} OUT keeps what is whole",
                                   path, problem, all.empty() ? "" : "; ", all, path)};
}

}  // namespace clothstream::cli
