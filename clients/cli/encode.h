// SPDX-License-Identifier: MIT
// `clothstream encode`: a motion becomes a recorded stream.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

enum class Quality : std::uint8_t { fine, standard, coarse };

// The max error, as a part of the mean edge of the cloth in its first frame.
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
  std::optional<double> maxError;  // m along each of three axes; instead of a quality
  std::uint32_t layers = 1;        // temporal
  std::uint32_t keyEvery = 0;      // frames; 0: the first alone
  bool json = false;
};

// Every frame is decoded again and compared before the file is put into its place. SIGINT and SIGTERM must be
// blocked: then there is no file.
ExitCode encode(const EncodeOptions& options);

}  // namespace clothstream::cli
