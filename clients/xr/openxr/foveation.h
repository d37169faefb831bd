// SPDX-License-Identifier: MIT
// Fewer fragments where the lenses blur the picture (XR_FB_foveation), by density maps of the runtime.
#pragma once

#include <cstdint>

#include "clients/xr/openxr/instance.h"

namespace clothstream::xr {

enum class FoveationLevel : std::uint8_t { kOff, kLow, kMedium, kHigh };

// Has the runtime write the density maps of a swapchain that was created with them. Throws an XrError if the
// runtime refuses.
void foveate(const Instance& instance, XrSession session, XrSwapchain swapchain, FoveationLevel level);

}  // namespace clothstream::xr
