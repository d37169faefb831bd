// SPDX-License-Identifier: MIT
#pragma once

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Bytes that a client sends to the web endpoint: HTTP requests, WebSocket handshakes and frames, static
// paths.
extern const Target kHttpTarget;

}  // namespace clothstream::fuzz
