// SPDX-License-Identifier: MIT
// `clothstream encode`: encodes a motion file as a stream file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

enum class Quality : std::uint8_t { fine, standard, coarse };

// Max error as a fraction of the mean edge length of the first frame.
constexpr double relativeError(Quality quality) {
  switch (quality) {
    case Quality::fine:
      return 0.0125;
    case Quality::standard:
      return 0.025;
    case Quality::coarse:
      return 0.05;
  }
  return 0.025;
}

struct EncodeOptions {
  std::string motion, out;
  Quality quality = Quality::standard;
  std::optional<double> maxError;  // m along each axis; replaces the quality
  std::uint32_t keyEvery = 0;      // frames; 0: only the first
  bool json = false;
};

// Decodes and checks every frame before the file appears. SIGINT and SIGTERM must be blocked in every thread;
// they cancel the command and leave no file.
ExitCode encode(const EncodeOptions& options);

}  // namespace clothstream::cli
