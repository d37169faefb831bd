// SPDX-License-Identifier: MIT
// When to ask for a key frame.
#pragma once

#include <cstdint>
#include <optional>

namespace clothstream::client {

// One request at a time; no two within kShortestIntervalUs. The server may refuse or forget one: after
// kPatienceUs without a key frame it is asked again.
class KeyFrameRequest {
 public:
  static constexpr std::uint64_t kShortestIntervalUs = 100'000;
  static constexpr std::uint64_t kPatienceUs = 1'000'000;

  // True if a request is to be sent now.
  bool wanted(std::uint64_t nowUs) {
    if (sentUs_ && nowUs - *sentUs_ < (outstanding_ ? kPatienceUs : kShortestIntervalUs)) return false;
    sentUs_ = nowUs;
    outstanding_ = true;
    return true;
  }
  void answered() { outstanding_ = false; }

 private:
  std::optional<std::uint64_t> sentUs_;
  bool outstanding_ = false;
};

}  // namespace clothstream::client
