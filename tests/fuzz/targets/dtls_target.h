// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Datagrams of a stranger for a DTLS channel: before a handshake, or into an open association. The first byte
// selects this and the role. Then follow datagrams: two bytes of length, then the bytes. A length with its
// highest bit set names a right datagram, of which one byte differs: its place in two bytes, then what it is
// XORed with. Promises: no such datagram opens a channel, delivers a payload or ends an open association, and
// a failure says why.
extern const Target kDtlsTarget;

}  // namespace clothstream::fuzz
