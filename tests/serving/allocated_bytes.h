// SPDX-License-Identifier: MIT
// Measures the memory that this process has allocated.
#pragma once

#include <cstddef>

#include <malloc.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// gcc has no header that declares it.
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
#endif

namespace clothstream::tests {

// Promised limit of the memory for one client, bytes. Uploads and data that all clients share are not
// included.
inline constexpr double kMaxBytesAClient = 4 << 20;

inline double allocatedBytes() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return static_cast<double>(__sanitizer_get_current_allocated_bytes());
#else
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
#endif
}

}  // namespace clothstream::tests
