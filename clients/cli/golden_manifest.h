// SPDX-License-Identifier: MIT
// golden.json: which recordings a folder has, and the hashes of what they contain.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include <tl/expected.hpp>

#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

inline constexpr const char* kManifestName = "golden.json";

// Content of a recording. Two recordings with the same hashes hold the same motion, whenever they were made.
struct GoldenRecording {
  std::uint64_t frames = 0, ticks = 0;
  std::uint64_t frameHash = 0;  // over tick, state hash and reconstruction hash of each frame
  std::uint64_t tickHash = 0;   // over number and state hash of each tick; 0 without ticks
  bool operator==(const GoldenRecording&) const = default;
};

using Manifest = std::map<std::string, GoldenRecording>;  // by file name

// Reads every byte of a recording, verifies its checksums and decodes every frame. The error names the path.
[[nodiscard]] tl::expected<GoldenRecording, std::string> readGolden(const std::string& path,
                                                                    const recording::ReadLimits& limits);

// Recordings of a folder: all files whose names end in .mcap.
[[nodiscard]] tl::expected<Manifest, std::string> readFolder(const std::string& directory,
                                                             const recording::ReadLimits& limits);

// Reads or writes DIRECTORY/golden.json.
[[nodiscard]] tl::expected<Manifest, std::string> readManifest(const std::string& directory);
[[nodiscard]] tl::expected<void, std::string> writeManifest(const std::string& directory,
                                                            const Manifest& manifest);

}  // namespace clothstream::cli
