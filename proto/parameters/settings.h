// SPDX-License-Identifier: MIT
// Units, ranges and defaults of the settings of solvers. Server and clients share them.
#pragma once

#include <cstdint>
#include <string_view>

#include "proto/parameters/cloth_parameters.h"

namespace clothstream::parameters {

struct Setting {
  std::string_view unit = {};  // empty if dimensionless
  Range range;
  float initial = 0;  // value where the scene gives none
};

// Both ends included.
struct Count {
  std::uint32_t min, max, initial;
};

// A solver without a compliance derives it; scene.proto describes how.
inline constexpr Count kIterations{1, 10'000, 20}, kXpbdIterations{1, 1'000, 1};
inline constexpr Setting kTolerance{.range = {0, 1}, .initial = 0.001f};
inline constexpr Setting kCompliance{.unit = "m/N", .range = {0, 1}};
inline constexpr Setting kActivation{.range = {0, 10}, .initial = 0.1f};  // fraction of a length

}  // namespace clothstream::parameters
