// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Files of motions and of recorded streams. The first byte selects the kind.
extern const Target kFilesTarget;

}  // namespace clothstream::fuzz
