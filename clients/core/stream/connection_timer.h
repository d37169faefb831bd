// SPDX-License-Identifier: MIT
// Says when the program should open a connection: because the last one has ended, or is silent.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "clients/core/stream/reconnection.h"

namespace clothstream::client {

// All times are microseconds. `graceUs` and `seed` are those of Reconnection.
class ConnectionTimer {
 public:
  void connecting(std::uint64_t nowUs, std::uint64_t graceUs) {
    welcomed_ = false;
    connectAtUs_ = reconnection_.attemptEnd(nowUs, graceUs);
  }
  void welcomed(std::uint64_t nowUs) {
    welcomed_ = true;
    reconnection_.joined(nowUs);
  }
  void lost(std::uint64_t nowUs, std::uint64_t graceUs, std::uint64_t seed) {
    welcomed_ = false;
    connectAtUs_ = reconnection_.lost(nowUs, graceUs, seed);
  }
  void heard(std::uint64_t nowUs) { heardUs_ = nowUs; }
  // A long pause between two updates does not count as silence: messages that arrived meanwhile are not read
  // yet.
  void update(std::uint64_t nowUs) {
    const std::uint64_t pauseUs = nowUs - std::exchange(updatedUs_, nowUs);
    if (pauseUs > Reconnection::kLongestStepUs)
      heardUs_ = std::min(nowUs, heardUs_ + pauseUs - Reconnection::kLongestStepUs);
  }

  // Whether the server has sent its Welcome on the current connection.
  bool isWelcomed() const { return welcomed_; }
  // When to open the next connection; Reconnection::kNever before the first one.
  std::uint64_t connectAtUs() const { return welcomed_ ? heardUs_ + Reconnection::kSilenceUs : connectAtUs_; }

 private:
  Reconnection reconnection_;
  bool welcomed_ = false;
  std::uint64_t connectAtUs_ = Reconnection::kNever;
  std::uint64_t heardUs_ = 0, updatedUs_ = 0;
};

}  // namespace clothstream::client
