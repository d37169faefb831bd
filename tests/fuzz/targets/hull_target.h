// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Convex hulls. Promise: the corners of an accepted hull lie inside its planes.
extern const Target kHullTarget;

}  // namespace clothstream::fuzz
