// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Text of scene files. Promise: an accepted scene is written and read without a change.
extern const Target kSceneJsonTarget;

}  // namespace clothstream::fuzz
