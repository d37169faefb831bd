// SPDX-License-Identifier: MIT
// How much memory this process holds.
#pragma once

#include <cstddef>

#include <malloc.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// gcc has no header for it.
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
#endif

namespace clothstream::tests {

// Promised of a client, beside what it uploads and what all share.
inline constexpr double kMostBytesAClient = 4 << 20;

inline double allocatedBytes() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return static_cast<double>(__sanitizer_get_current_allocated_bytes());
#else
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
#endif
}

}  // namespace clothstream::tests
