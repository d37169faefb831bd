// SPDX-License-Identifier: MIT
// Counts the allocations of one thread of the test program. Those of shared libraries in C, such as a
// graphics driver, are not counted.
#pragma once

#include <cstddef>

namespace clothstream::xr::tests {

class Allocations {
 public:
  Allocations();
  // Allocations of this thread since the constructor.
  std::size_t count() const;
  // Those of libclothstream, after countAllocationsOfLibrary(); count() is without them.
  std::size_t ofLibrary() const;

 private:
  std::size_t before_, libraryBefore_;
};

// Makes libclothstream allocate with functions that count. Call it once, before its other functions.
void countAllocationsOfLibrary();

}  // namespace clothstream::xr::tests
