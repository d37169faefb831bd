// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Datagrams for the ICE agents of server and client. The first byte says whether the rest is a datagram, or
// the attributes of a message whose length, MESSAGE-INTEGRITY and FINGERPRINT are right. Promises: only
// datagrams with the password have an effect, answers are no longer than the request, and what is sent to an
// address that is not proven is at most three times what came from it.
extern const Target kStunTarget;

}  // namespace clothstream::fuzz
