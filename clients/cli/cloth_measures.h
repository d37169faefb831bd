// SPDX-License-Identifier: MIT
// Measures of each cloth in each frame of a motion.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <tl/expected.hpp>

#include "clients/cli/motion.h"
#include "clients/measure/strain.h"

namespace clothstream::cli {

struct ClothMeasures {
  measure::StrainFigures strain;
  double penetration = 0;         // metres
  std::size_t intersections = 0;  // places where an edge of this cloth pierces a triangle of any cloth
  std::optional<double> kinetic;  // J; absent in the first and last frame
  double gravity = 0;             // J
};

struct FrameMeasures {
  std::uint64_t tick = 0;
  double seconds = 0;
  float farthest = 0;  // largest magnitude of a coordinate, metres
  std::vector<ClothMeasures> cloths;
};

struct MeasureSettings {
  std::vector<double> arealMass;  // of each cloth, kg/m^2
  measure::Point gravity{};       // m/s^2
  bool intersections = true;      // false leaves the numbers 0
};

// Calls `take` for every frame in order. Memory holds three frames.
[[nodiscard]] tl::expected<void, Error> measureFrames(Motion& motion, const MeasureSettings& settings,
                                                      const std::function<void(const FrameMeasures&)>& take);

}  // namespace clothstream::cli
