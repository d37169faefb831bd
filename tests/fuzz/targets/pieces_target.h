// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Datagrams of a server, as a client takes them. Promises: a frame that comes out has the length that its
// pieces announced, requests and their times are bounded, and what is read is written as the same bytes.
extern const Target kPiecesTarget;

}  // namespace clothstream::fuzz
