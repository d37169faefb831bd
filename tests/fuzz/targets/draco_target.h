// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Bytes of a mesh that is compressed with Draco.
extern const Target kDracoTarget;

}  // namespace clothstream::fuzz
