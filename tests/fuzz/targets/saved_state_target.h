// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Rows of the saved state, as messages and as bytes of a damaged file. Promises: what is accepted is written
// and read without a change, and fits its scene.
extern const Target kSavedStateTarget;

}  // namespace clothstream::fuzz
