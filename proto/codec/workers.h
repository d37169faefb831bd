// SPDX-License-Identifier: MIT
// Interface to worker threads that the program provides.
#pragma once

#include <cstdint>
#include <functional>

namespace clothstream::codec {

class Workers {
 public:
  virtual ~Workers() = default;
  // Calls `piece` for each number below `pieces`, several at a time and in any order. Returns when all calls
  // have returned. An encoder calls it on one thread at a time. Encoders that share workers may call it at
  // the same time. `piece` does not throw.
  virtual void run(std::uint32_t pieces, const std::function<void(std::uint32_t)>& piece) = 0;
};

}  // namespace clothstream::codec
