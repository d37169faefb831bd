// SPDX-License-Identifier: MIT
// Pieces of one frame, until they are enough.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "proto/datagram/piece.h"

namespace clothstream::datagram {

// Memory grows with the pieces that arrive, not with the announced size: at most twice their bytes, and the
// message in addition while it is put together.
class PartialFrame {
 public:
  enum class Added {
    useless,  // a piece that is there, one of a complete frame, or one that contradicts earlier pieces
    stored,
    completed,
  };
  Added add(const Piece& piece);

  const PieceSet& present() const { return present_; }
  bool isComplete() const { return !message_.empty(); }
  // Returns whether a complete frame was made with parity.
  bool usedParity() const { return usedParity_; }
  // Takes the message of a complete frame.
  std::vector<std::byte> takeMessage() { return std::move(message_); }

 private:
  void putTogether();

  std::uint8_t dataPieces_ = 0;  // 0 before the first piece
  std::uint32_t frameBytes_ = 0;
  PieceSet present_;
  bool usedParity_ = false;
  std::array<std::uint8_t, kMaxDataPieces> indices_{};  // of the stored pieces
  std::vector<std::byte> stored_;                       // one piece after the other
  std::vector<std::byte> message_;                      // empty until the frame is complete
};

}  // namespace clothstream::datagram
