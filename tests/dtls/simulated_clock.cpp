// SPDX-License-Identifier: MIT
#include "tests/dtls/simulated_clock.h"

#include <sys/time.h>

namespace clothstream::dtls {

std::chrono::steady_clock::time_point& simulatedNow() {
  static std::chrono::steady_clock::time_point now(std::chrono::hours(1000));
  return now;
}

}  // namespace clothstream::dtls

// Takes the place of the C library's function, also in shared libraries.
extern "C" int gettimeofday(timeval* __restrict time, void* __restrict) noexcept {
  const auto now = std::chrono::duration_cast<std::chrono::microseconds>(
      clothstream::dtls::simulatedNow().time_since_epoch());
  time->tv_sec = now.count() / 1'000'000;
  time->tv_usec = now.count() % 1'000'000;
  return 0;
}
