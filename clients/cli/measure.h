// SPDX-License-Identifier: MIT
// `clothstream measure`: strain, penetration, intersections and energy from positions.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "clients/cli/exit_code.h"
#include "clients/cli/motion.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

enum class MeasureFormat : std::uint8_t { text, json, csv };

struct MeasureOptions {
  std::string file;     // recording or .npz
  ArrayOptions arrays;  // for .npz
  recording::ReadLimits limits{};
  // Mass per area at rest, kg/m^2; absent: of the recorded scene, otherwise 0.2.
  std::optional<double> arealMass;
  // Acceleration, m/s^2; absent: of the recorded scene, otherwise (0, -9.81, 0).
  std::optional<measure::Point> gravity;
  bool intersections = true;
  MeasureFormat format = MeasureFormat::text;
};

// SIGINT and SIGTERM must be blocked in every thread.
ExitCode measureFile(const MeasureOptions& options);

}  // namespace clothstream::cli
