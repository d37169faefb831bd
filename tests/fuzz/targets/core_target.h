// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// The C interface of the client core: bytes of a hostile server and calls of its program, in any order.
// Promises: triangles name existing vertices, numbers of geometry are finite, and strings end.
extern const Target kCoreTarget;

}  // namespace clothstream::fuzz
