// SPDX-License-Identifier: MIT
// The library shares the C++ library of the program, whose memory functions it must not replace.
#include "clients/library/allocation.h"

namespace clothstream {

std::string useAllocator(const clothstream_allocator&) {
  return "This library was built for gRPC, for macOS or with sanitizers, and cannot use an allocator of the "
         "program.";
}

}  // namespace clothstream
