// SPDX-License-Identifier: MIT
// Datagram that says which packets with pieces have arrived, for the server's rate controller.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/datagram/datagram.h"

namespace clothstream::datagram {

struct Receipt {
  // Newest packet that arrived.
  std::uint32_t newest = 0;
  // Client's clock at its arrival, microseconds, modulo 2^32.
  std::uint32_t arrivalUs = 0;
  // Bit i: packet newest - 1 - i arrived. Bits of packets before the first one are 0.
  std::uint64_t before = 0;

  // Returns whether the receipt says that this packet arrived. False for packets that it does not cover.
  bool shows(std::uint32_t packet) const;
};

// Writes the datagram to `out`, which has at least kMaxDatagramBytes, and returns its length.
std::size_t writeReceipt(const Receipt& receipt, std::span<std::byte> out);

// nullopt if the datagram has another kind or length.
[[nodiscard]] std::optional<Receipt> parseReceipt(std::span<const std::byte> datagram);

// Collects the packets that a client receives. A receipt is due 20 ms after the first packet that no receipt
// names, and at once after 32 such packets, so that each packet is in two receipts when packets come fast.
class ReceivedPackets {
 public:
  static constexpr std::uint64_t kIntervalUs = 20'000;
  static constexpr unsigned kMaxUnreported = 32;

  void add(std::uint32_t packet, std::uint64_t nowUs);

  // Time at which a receipt is due without further packets; nullopt if the last one named all packets.
  std::optional<std::uint64_t> dueUs() const;

  // Returns what to report now; nullopt if no packet has arrived since the last call.
  std::optional<Receipt> take();

 private:
  bool any_ = false;
  Receipt receipt_;
  unsigned unreported_ = 0;
  std::uint64_t firstUnreportedUs_ = 0;
};

}  // namespace clothstream::datagram
