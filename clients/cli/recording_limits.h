// SPDX-License-Identifier: MIT
// What the commands that read recordings or streams have in common: their limits, and the error for a damaged
// recording.
#pragma once

#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/recording/played_recording.h"
#include "proto/codec/stream_layout.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

// Adds --max-vertices for recordings.
inline void addLimits(CLI::App& command, recording::ReadLimits& limits) {
  command
      .add_option("--max-vertices", limits.vertices,
                  "Most vertices of a file, and half of its most triangles, since the file decides how much "
                  "memory is needed")
      ->check(CLI::Range(1u, codec::kMaxVertices))
      ->capture_default_str();
}

// Adds --max-vertices for the stream of a server. `vertices` stays 0 without it.
inline void addStreamLimit(CLI::App& command, std::uint32_t& vertices) {
  command
      .add_option("--max-vertices", vertices,
                  fmt::format("Most vertices to accept from the server; twice as many triangles. Default: {}",
                              codec::kDefaultMaxVertices))
      ->check(CLI::Range(1u, codec::kMaxVertices));
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
