// SPDX-License-Identifier: MIT
// Frames from pieces on the client's side: order, missing pieces, and requests for them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/datagram/partial_frame.h"
#include "proto/datagram/piece_request.h"
#include "proto/datagram/reorder_window.h"

namespace clothstream::datagram {

struct AssemblyStatistics {
  std::uint64_t pieces = 0;
  // Pieces of complete or lost frames, duplicates, and pieces that contradict others of their frame.
  std::uint64_t uselessPieces = 0;
  std::uint64_t frames = 0;  // complete
  // Complete frames that needed parity or a request.
  std::uint64_t repairedFrames = 0;
  std::uint64_t requests = 0;
  std::uint64_t lostFrames = 0;
};

struct AssembledFrame {
  // A serialised ServerMessage.
  std::span<const std::byte> message;
  // Whether frames before this one are lost. The client then needs a key frame.
  bool afterGap = false;
};

// Emits complete frames in the order of their numbers. A frame waits for those before it until they are
// complete, or until their deadline has passed.
//
// A frame is late when a piece of a later frame has arrived and the reorder window is over, when no piece of
// a frame has followed its last one for two frame intervals (its end may be lost), or when its number was
// left out. Its missing pieces are then requested, and again after 1.5 round trips, until the deadline. After
// silence of two frame intervals the next frame is requested once, because the last frame of a scene that
// pauses may be lost as a whole.
//
// Holds at most 32 frames, in memory that grows with the pieces that arrive: less than 10 MB. A jump by more
// than 8 missing frames, or beyond the 32, is a gap at once: a key frame costs less than the repeats.
//
// After each add() call next() until it returns nullopt, then nextRequest() likewise; do the same at dueUs().
class FrameAssembly {
 public:
  static constexpr std::uint64_t kDeadlineUs = 150'000;
  static constexpr std::uint32_t kMaxFrames = 32, kMaxMissing = 8;

  // `deadlineUs`: time from the first sign of a frame until it is given up.
  explicit FrameAssembly(std::uint64_t deadlineUs = kDeadlineUs) : deadlineUs_(deadlineUs) {}

  // Round-trip time of the link. 100 ms until it is called.
  void setRoundTrip(std::uint64_t microseconds) { roundTripUs_ = microseconds; }

  void add(const Piece& piece, std::uint64_t nowUs);

  // Returns the next frame that need not wait. The message is valid until next() is called
  // again.
  std::optional<AssembledFrame> next(std::uint64_t nowUs);

  // Returns a request that is to be sent now.
  std::optional<PieceRequest> nextRequest(std::uint64_t nowUs);

  // Time at which next() or nextRequest() may return something without further pieces; nullopt if never.
  std::optional<std::uint64_t> dueUs() const;

  const AssemblyStatistics& statistics() const { return statistics_; }

 private:
  // A frame from the first sign of it until it is emitted or given up.
  struct Expected {
    PartialFrame pieces;
    std::uint64_t noticedUs = 0;
    std::uint64_t newestPieceUs = 0;
    std::optional<std::uint64_t> overtakenUs;  // first piece of a later frame
    std::optional<std::uint64_t> requestedUs;
  };

  Expected& expected(std::uint32_t number) { return frames_[number % kMaxFrames]; }
  const Expected& expected(std::uint32_t number) const { return frames_[number % kMaxFrames]; }
  void expectUpTo(std::uint32_t number, std::uint64_t nowUs);
  void giveUp();
  std::uint64_t silenceUs() const;
  std::uint64_t requestUs(const Expected& frame) const;
  std::uint64_t probeUs() const { return newestUs_ + silenceUs(); }

  std::uint64_t deadlineUs_;
  std::uint64_t roundTripUs_ = 100'000;
  std::array<Expected, kMaxFrames> frames_;  // frame n is at n modulo 32
  std::uint32_t next_ = 0;                   // next frame to emit
  std::uint32_t end_ = 0;                    // one after the newest frame of which there is a sign
  bool gap_ = false;                         // frames before next_ are lost
  std::vector<std::byte> emitted_;
  ReorderWindow reorderWindow_;
  double intervalUs_ = 25'000;  // between first pieces of successive frames, smoothed
  std::uint64_t newestUs_ = 0;  // first piece of the newest frame
  bool probed_ = true;          // the frame after the newest was requested, or there is no frame yet
  AssemblyStatistics statistics_;
};

}  // namespace clothstream::datagram
