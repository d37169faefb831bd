// SPDX-License-Identifier: MIT
// Client's side of one pair of ways to the server: datagrams, and the stream of messages.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>

#include "clients/core/core.h"
#include "clients/core/datagrams/frame_order.h"
#include "clients/core/wire/wire.h"
#include "proto/datagram/frame_assembly.h"
#include "proto/datagram/input_bundle.h"
#include "proto/datagram/receipt.h"

namespace clothstream::client {

// The functions are those of cs_datagrams in core.h. Reads no clock.
class DatagramLink {
 public:
  // Input travels in datagrams while one has arrived from the server in this time.
  static constexpr std::uint64_t kInUseUs = 500'000;
  // The newest poses travel on the stream, too, if none follow them for this time, and so does the newest
  // acknowledgement: a server whose window is full sends nothing before it.
  static constexpr std::uint64_t kSettleUs = 100'000;
  // Input that the program has not taken yet; the oldest is dropped.
  static constexpr std::size_t kMaxWaiting = 16;

  void receive(std::span<const std::byte> datagram, std::uint64_t nowUs);
  bool holds(Bytes message, std::uint64_t nowUs);
  bool sends(Bytes message, std::uint64_t nowUs);

  // These return empty views if there is nothing. A view is valid until the next call of any of them.
  Bytes nextMessage(std::uint64_t nowUs);
  std::span<const std::byte> nextDatagram(std::uint64_t nowUs);
  Bytes nextStreamMessage(std::uint64_t nowUs);
  std::optional<std::uint64_t> dueUs() const;

  void setRoundTrip(std::uint64_t us) { assembly_.setRoundTrip(us); }
  cs_datagram_statistics statistics(std::uint64_t nowUs) const;

 private:
  struct Datagram {
    std::array<std::byte, datagram::kMaxDatagramBytes> bytes;
    std::size_t size = 0;
  };
  // The newest message of a kind, which only datagrams have carried.
  struct Unsettled {
    std::string message;
    std::uint64_t sentUs = 0;
  };

  bool inUse(std::uint64_t nowUs) const { return heardUs_ && nowUs < *heardUs_ + kInUseUs; }
  void count(const datagram::Piece& piece);

  std::optional<std::uint64_t> heardUs_;  // arrival of the newest piece
  datagram::FrameAssembly assembly_;
  FrameOrder order_;
  std::uint64_t lostBeforeStream_ = 0;  // frames that were lost when the newest frame of the stream passed
  datagram::ReceivedPackets received_;
  bool completed_ = false;  // a frame, since the last receipt
  datagram::InputSender input_;
  std::deque<Datagram> waiting_;
  std::optional<Unsettled> poses_, acknowledgement_;
  std::string message_;  // that the last call returned
  Datagram datagram_;    // that the last call returned
  // Packets counted without a limit of 32 bits.
  std::uint64_t packets_ = 0, newestPacket_ = 0, parityPackets_ = 0;
};

}  // namespace clothstream::client
