// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Bytes of glTF files, text or binary, up to the mesh of a cloth.
extern const Target kGltfTarget;

}  // namespace clothstream::fuzz
