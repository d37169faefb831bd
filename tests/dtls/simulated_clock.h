// SPDX-License-Identifier: MIT
// A clock that stands still until the test moves it, also for OpenSSL.
#pragma once

#include <chrono>

namespace clothstream::dtls {

// Time that gettimeofday() returns in the whole program. OpenSSL's timer for handshakes reads it.
std::chrono::steady_clock::time_point& simulatedNow();

}  // namespace clothstream::dtls
