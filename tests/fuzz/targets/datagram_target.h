// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Datagrams of a client, as a server takes them. Promises: repeats stay within their share of the bytes that
// the peer was sent, messages come out in order and are not empty, and what is read is written as the same
// bytes.
extern const Target kDatagramTarget;

}  // namespace clothstream::fuzz
