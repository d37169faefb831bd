// SPDX-License-Identifier: MIT
// Frames that one peer was sent in pieces, and answers to its requests for missing pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "proto/datagram/frame_pieces.h"
#include "proto/datagram/piece_request.h"

namespace clothstream::datagram {

// Numbers the frames of a peer from 0, and remembers those of the last 500 ms: at most 64, which hold at most
// 512 KiB, and always the newest. Memory is shared with the other peers of the scene.
//
// A peer that requests pieces cannot multiply traffic: repeats take from a budget of 64 KiB, to which half of
// the bytes that the peer is sent for the first time are added. Over any time, it gets at most 1.5 times the
// bytes of its frames, and 64 KiB more.
class SentFrames {
 public:
  static constexpr std::uint64_t kKeptUs = 500'000;
  static constexpr std::size_t kMaxFrames = 64, kMaxBytes = 512 * 1024;
  static constexpr std::size_t kMaxBudget = 64 * 1024;

  // Takes a frame, of which the peer is now sent the first `pieces`. Returns the frame's number.
  std::uint32_t add(std::shared_ptr<const FramePieces> frame, unsigned pieces, std::uint64_t nowUs);

  // Pieces to send again, under the number of their frame.
  struct Repeat {
    std::shared_ptr<const FramePieces> frame;
    std::uint32_t number = 0;
    PieceSet pieces;
  };
  // Answers a request with as many pieces as the peer misses and one more, since a repeat can be lost, too:
  // data pieces first, then parity pieces. Fewer if the budget ends. nullopt if there is nothing to send: the
  // frame was never sent or is forgotten, the peer has enough pieces, or the budget is used up.
  std::optional<Repeat> answer(const PieceRequest& request, std::uint64_t nowUs);

 private:
  struct Sent {
    std::shared_ptr<const FramePieces> frame;
    std::uint64_t sentUs = 0;
  };

  void forget();

  std::deque<Sent> sent_;        // oldest first; the newest has the number next_ - 1
  std::size_t storedBytes_ = 0;  // of these frames
  std::uint32_t next_ = 0;
  std::size_t budget_ = kMaxBudget;
};

}  // namespace clothstream::datagram
