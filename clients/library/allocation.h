// SPDX-License-Identifier: MIT
// Memory functions of the program that the library uses.
#pragma once

#include <string>

#include <clothstream/clothstream.h>

namespace clothstream {

// Uses these functions from now on. Returns an empty text, or what is wrong: the library already uses memory,
// or was built without this.
[[nodiscard]] std::string useAllocator(const clothstream_allocator& allocator);

}  // namespace clothstream
