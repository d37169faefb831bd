// SPDX-License-Identifier: MIT
// The participants who ask for something that everyone receives while anybody asks.
#pragma once

#include <cstdint>
#include <set>

namespace clothstream::scene {

class Requests {
 public:
  // Sets whether this participant asks.
  void set(std::uint64_t participant, bool asks) {
    if (asks)
      asking_.insert(participant);
    else
      asking_.erase(participant);
  }
  bool any() const { return !asking_.empty(); }

 private:
  std::set<std::uint64_t> asking_;
};

}  // namespace clothstream::scene
