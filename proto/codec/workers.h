// SPDX-License-Identifier: MIT
// Threads that somebody else has.
#pragma once

#include <cstdint>
#include <functional>

namespace clothstream::codec {

class Workers {
 public:
  virtual ~Workers() = default;
  // Does `piece` for each number below `pieces`, several at a time and in any order; returns when all are
  // done. For one caller at a time.
  virtual void run(std::uint32_t pieces, const std::function<void(std::uint32_t)>& piece) = 0;
};

}  // namespace clothstream::codec
