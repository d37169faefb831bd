// SPDX-License-Identifier: MIT
// A frame cut into pieces with parity, made once and shared by all peers.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "proto/datagram/piece.h"

namespace clothstream::datagram {

// Immutable. Holds the message and its parity pieces.
class FramePieces {
 public:
  using Message = std::shared_ptr<const std::vector<std::byte>>;

  // Returns whether a message of this length travels in pieces: 1 to 144,768 bytes.
  static bool fits(std::size_t messageBytes) { return messageBytes > 0 && messageBytes <= kMaxFrameBytes; }

  // Cuts a serialised ServerMessage into as few data pieces as possible, and makes 0 to 32 parity pieces. A
  // peer need not be sent all of these. The cost is that of makeParity() for each.
  FramePieces(Message message, unsigned parityPieces);

  unsigned dataPieces() const { return dataPieces_; }
  // Number of data and parity pieces.
  unsigned pieces() const { return dataPieces_ + static_cast<unsigned>(parity_.size() / payloadBytes()); }
  // Bytes of the datagram of each piece.
  std::size_t datagramBytes() const { return kPieceHeaderBytes + payloadBytes(); }
  std::size_t messageBytes() const { return message_->size(); }
  // Bytes of the message and its parity.
  std::size_t storedBytes() const { return message_->size() + parity_.size(); }

  // Writes the datagram of a piece, below pieces(), to `out`, which has at least kMaxDatagramBytes. Returns
  // its length.
  std::size_t write(const PiecePrefix& prefix, unsigned index, std::span<std::byte> out) const;

 private:
  std::size_t payloadBytes() const { return datagram::payloadBytes(message_->size(), dataPieces_); }
  std::span<const std::byte> payload(unsigned index) const;

  Message message_;
  unsigned dataPieces_;
  std::vector<std::byte> parity_;  // one piece after the other
};

}  // namespace clothstream::datagram
