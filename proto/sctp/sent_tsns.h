// SPDX-License-Identifier: MIT
// TSNs that were sent: what is in flight, what is repeated, and what is given up (RFC 3758).
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/sctp/chunks.h"

namespace clothstream::sctp {

using Time = std::chrono::steady_clock::time_point;
using Duration = std::chrono::steady_clock::duration;
// Deadline of a timer that is not set.
inline constexpr Time kNever = Time::max();

// Sender's side of an association. A message is sent once, and given up if it is lost. The few reliable ones
// are kept until they are acknowledged. Needs memory only for these.
class SentTsns {
 public:
  // Time without any acknowledgement after which everything in flight counts as lost.
  static constexpr Duration kSilence = std::chrono::seconds(1);

  // `patience`: time from the acknowledgement that first shows a gap until the gap is given up. A gap that
  // appears meanwhile waits up to twice as long.
  SentTsns(std::uint32_t firstTsn, Duration patience)
      : next_(firstTsn), acknowledged_(firstTsn - 1), seen_(acknowledged_), patience_(patience) {}

  // Sets the window that the peer advertised in its INIT or INIT ACK, bytes.
  void setWindow(std::uint32_t bytes) { window_ = bytes; }
  // Whether one more message may be in flight: it fits into the peer's window, where every message counts as
  // a full one (kMaxPayloadBytes), or nothing else is in flight (RFC 9260, section 6.1, rule A).
  bool hasRoom(Time now);
  // Assigns the TSN of a message that is sent now.
  std::uint32_t take(Time now);

  // A reliable message, with `data.tsn` from take().
  void keep(const Data& data);
  struct Kept {
    Data data;  // without payload
    std::vector<std::byte> payload;
  };
  std::span<const Kept> kept() const { return kept_; }

  // Returns false if the acknowledgement is late or impossible, and then ignores it.
  bool acknowledge(Time now, const Sack& sack);
  // Time at which giveUp() has something to do.
  Time deadline() const { return giveUpAt_; }
  // Returns the new cumulative TSN of a FORWARD-TSN, if one must be sent now.
  std::optional<std::uint32_t> giveUp(Time now);

  std::uint32_t newest() const { return next_ - 1; }

 private:
  std::uint32_t next_;
  std::uint32_t acknowledged_;  // the peer's cumulative TSN
  std::uint32_t seen_;          // the highest TSN that the peer has; those before it are not in flight
  std::uint32_t window_ = 0;
  Time heard_{};  // newest acknowledgement, or the first message after all were acknowledged
  const Duration patience_;
  std::uint32_t giveUpTo_ = 0;  // has a meaning while giveUpAt_ is set
  Time giveUpAt_ = kNever;
  std::vector<Kept> kept_;
};

}  // namespace clothstream::sctp
