// SPDX-License-Identifier: MIT
// Counts the allocations of one thread of the test program. Those of libraries with their own functions, such
// as a graphics driver in C, are not counted.
#pragma once

#include <cstddef>

namespace clothstream::xr::tests {

class Allocations {
 public:
  Allocations();
  // Allocations of this thread since the constructor.
  std::size_t count() const;

 private:
  std::size_t before_;
};

}  // namespace clothstream::xr::tests
