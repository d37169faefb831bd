// SPDX-License-Identifier: MIT
// Puts messages together from segments that are lost, repeated or late on the way.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "clothstream/v1/fleet.pb.h"
#include "server/delivery/envelope.h"

namespace clothstream::fleet {

struct ReceivedMessage {
  delivery::SharedBytes message;  // null: the end
  v1::TunnelEnd end = v1::TUNNEL_END_UNSPECIFIED;
  std::uint64_t sequence = 0;  // of its last segment
  std::uint64_t timeUs = 0;    // at which it was sent first, by the clock of the other end
};

// Segments out of order are dropped. Those of an incomplete message are used when everything before them is,
// because a message that is longer than the window must not wait for its own end. Not thread-safe.
class MessageAssembly {
 public:
  // Segments that would make a message longer are left out.
  static constexpr std::size_t kMaxMessageBytes = std::size_t{256} << 20;

  // `received`: newest segment that is used already.
  explicit MessageAssembly(std::uint64_t received) : newest_(received), whole_(received), used_(received) {}

  // Returns the message that is complete now.
  [[nodiscard]] std::optional<ReceivedMessage> add(const v1::Segment& segment);
  // The message of this number, and all before it, are used.
  void use(std::uint64_t sequence) {
    used_ = std::max(used_, sequence);
    if (used_ >= whole_) used_ = newest_;
  }

  // Newest segment whose message is complete.
  std::uint64_t whole() const { return whole_; }
  // Newest segment that is used.
  std::uint64_t used() const { return used_; }

 private:
  std::uint64_t newest_, whole_, used_;
  std::string partial_;
};

}  // namespace clothstream::fleet
