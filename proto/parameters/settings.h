// SPDX-License-Identifier: MIT
// Units, ranges and defaults of the settings of solvers and of the environment. Server and clients share
// them.
#pragma once

#include <cstdint>
#include <string_view>

#include "proto/parameters/cloth_parameters.h"

namespace clothstream::parameters {

struct Setting {
  std::string_view unit = {};  // empty if dimensionless
  Range range;                 // of each component
  float initial = 0;           // value where the scene gives none
};

// Both ends included.
struct Count {
  std::uint32_t min, max, initial;
};

// Solvers. A solver without a compliance derives it; scene.proto describes how.
inline constexpr Count kIterations{1, 10'000, 20}, kXpbdIterations{1, 1'000, 1};
inline constexpr Setting kTolerance{.range = {0, 1}, .initial = 0.001f};
inline constexpr Setting kCompliance{.unit = "m/N", .range = {0, 1}};
inline constexpr Setting kActivation{.range = {0, 10}, .initial = 0.1f};  // fraction of a length

// Environment. `initial` of the gravity is that of its Y component, which points up. The X and Z components
// are 0 by default.
inline constexpr Setting kGravity{.unit = "m/s^2", .range = {-1000, 1000}, .initial = -9.81f};
inline constexpr Setting kWind{.unit = "m/s", .range = {-100, 100}};
inline constexpr Setting kAirDensity{.unit = "kg/m^3", .range = {0, 100}, .initial = 1.2f};
inline constexpr Setting kGustStrength{.unit = "m/s", .range = {0, 100}};
inline constexpr Setting kGustSeconds{.unit = "s", .range = {0.01, 3600}, .initial = 2};

}  // namespace clothstream::parameters
