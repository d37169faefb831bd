// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Tokens, also signed ones with any header and claims. Promise: only tokens that the key has signed for the
// audience, and whose time has not passed, are accepted.
extern const Target kTokenTarget;

}  // namespace clothstream::fuzz
