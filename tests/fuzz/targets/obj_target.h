// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Text of OBJ files, up to the mesh of a cloth.
extern const Target kObjTarget;

}  // namespace clothstream::fuzz
