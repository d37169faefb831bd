// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Packets of a peer of the data channel, before and after the handshake. Promises: what is sent can be read,
// a packet causes few bytes, timers end, and messages are whole.
extern const Target kSctpTarget;

}  // namespace clothstream::fuzz
