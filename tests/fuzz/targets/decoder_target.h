// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// The frame decoder with any layout and sequence of packets. Promises: coordinates and normals are finite, a
// refused packet changes nothing, and ticks grow.
extern const Target kDecoderTarget;

}  // namespace clothstream::fuzz
