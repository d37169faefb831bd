// SPDX-License-Identifier: MIT
// Choice of a headset's refresh rate.
#pragma once

#include <span>

namespace clothstream::xr {

// Rate to ask for, among those that a headset offers, in Hz. `wanted` above 0: the nearest one. `wanted` of
// 0: the lowest of at least 72 Hz that is a multiple of the stream's rate, so that each frame is shown
// equally long; else `current`. Returns 0 if the headset offers none.
float chooseRefreshRate(std::span<const float> offered, float wanted, float streamRate, float current);

}  // namespace clothstream::xr
