// SPDX-License-Identifier: MIT
// Packets of one peer from sending to the report of their fate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "server/delivery/loss_meter.h"
#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// A packet counts as lost when a packet that was sent a reordering window later has arrived (RFC 8985,
// section 6.2), or when receipts no longer cover it. A packet without a report for kLongest counts neither as
// arrived nor as lost.
//
// Holds at most kMost packets; the oldest one is then given up. Not thread-safe.
class SentPackets {
 public:
  static constexpr std::size_t kMost = 8192;
  static constexpr std::chrono::milliseconds kLongest{500};
  static constexpr std::uint32_t kMask = 64;  // packets before the newest one in a receipt

  struct Packet {
    std::uint32_t bytes = 0;
    Clock::time_point sent{};
    bool arrived = false;
    // State when the packet was sent: bytes that had arrived, and the receiver's clock at the newest of them
    // (draft-cheng-iccrg-delivery-rate-estimation-02, section 2.2).
    std::uint64_t arrivedBefore = 0;
    std::optional<std::uint32_t> arrivalUsBefore;
  };

  // Consecutive numbers, modulo 2^32.
  void add(std::uint32_t number, std::uint32_t bytes, Clock::time_point now);

  struct Report {
    std::uint32_t bytes = 0;    // that arrived, and were not reported before
    std::uint32_t packets = 0;  // whose fate is now known
    std::uint32_t lost = 0;
    std::uint32_t newestLost = 0;  // its number, if any was lost
    std::optional<Packet> newest;  // of the receipt, if no receipt before named this packet or a later one
  };
  // Applies a receipt: packet `newest` arrived at `arrivalUs` on the receiver's clock, and packet
  // newest - 1 - i if bit i of `mask` is set. Receipts may come late or twice. Returns nothing, and changes
  // nothing, if `newest` is later than the newest packet.
  [[nodiscard]] std::optional<Report> receive(std::uint32_t newest, std::uint32_t arrivalUs,
                                              std::uint64_t mask, Clock::duration reordering);
  // Gives up packets without a report for kLongest. Returns whether there were any.
  bool expire(Clock::time_point now);

  std::uint64_t inFlight() const { return inFlight_; }  // bytes
  std::uint64_t arrived() const { return arrived_; }    // bytes, in all
  std::uint32_t next() const { return first_ + static_cast<std::uint32_t>(packets_.size()); }
  std::uint64_t lost() const { return lost_; }  // packets, in all
  const LossMeter& loss() const { return loss_; }

 private:
  void removeFirst();

  std::deque<Packet> packets_;  // number first_ and those after it
  std::uint32_t first_ = 0;
  std::uint64_t inFlight_ = 0, arrived_ = 0;
  std::optional<std::uint32_t> newest_;  // in a receipt
  std::optional<std::uint32_t> arrivalUs_;
  std::uint64_t lost_ = 0;
  LossMeter loss_;
};

}  // namespace clothstream::delivery
