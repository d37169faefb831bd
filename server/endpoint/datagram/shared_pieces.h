// SPDX-License-Identifier: MIT
// Frames in pieces, made once for all peers of a scene.
#pragma once

#include <cstddef>
#include <memory>
#include <unordered_map>

#include "proto/datagram/frame_pieces.h"
#include "server/delivery/envelope.h"

namespace clothstream::endpoint {

// A frame is one message for all subscribers of its quality, so the message identifies it. Pieces are made
// when the first peer needs them, and again, with at least twice the parity, if a later one needs more. Peers
// of different needs thus cost at most three times the parity of the neediest. Pieces are forgotten when no
// peer uses them any more. Not thread-safe.
class SharedPieces {
 public:
  // Returns the pieces of a message that fits (datagram::FramePieces::fits), with at least `rows` parity
  // pieces, 0 to datagram::kMaxParityPieces.
  std::shared_ptr<const datagram::FramePieces> of(const delivery::SharedBytes& message, unsigned rows);

 private:
  // By the address of the message, which is unique while its pieces hold it.
  std::unordered_map<const void*, std::weak_ptr<const datagram::FramePieces>> pieces_;
  std::size_t sweepBeyond_ = 64;
};

}  // namespace clothstream::endpoint
