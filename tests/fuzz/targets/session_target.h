// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Messages of peers through whole sessions, with a scene whose ticks need no device. Promises: an honest peer
// of the scene is closed only by an owner, and every message that a peer is sent can be parsed.
extern const Target kSessionTarget;

}  // namespace clothstream::fuzz
