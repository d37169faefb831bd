// SPDX-License-Identifier: MIT
#include "proto/datagram/frame_assembly.h"

#include <algorithm>
#include <utility>

namespace clothstream::datagram {
namespace {

// Weight of a new interval between frames, as for round-trip times (RFC 6298 section 2).
constexpr double kSmoothing = 1.0 / 8;
constexpr std::uint64_t kMaxIntervalUs = 1'000'000;
// Bounds on the wait for the end of a frame after which no other has arrived yet.
constexpr std::uint64_t kMinSilenceUs = 10'000, kMaxTailUs = 50'000;
// Bound on the interval of requests where the round trip is short: the server may be busy.
constexpr std::uint64_t kMinRepeatUs = 10'000;

}  // namespace

std::uint64_t FrameAssembly::silenceUs() const {
  return std::max(kMinSilenceUs, static_cast<std::uint64_t>(2 * intervalUs_));
}

std::uint64_t FrameAssembly::requestUs(const Expected& frame) const {
  if (frame.requestedUs) return *frame.requestedUs + std::max(kMinRepeatUs, roundTripUs_ * 3 / 2);
  if (frame.overtakenUs) return *frame.overtakenUs + reorderWindow_.us();
  return frame.newestPieceUs + std::min(kMaxTailUs, silenceUs());
}

void FrameAssembly::giveUp() {
  ++statistics_.lostFrames;
  expected(next_) = {};
  ++next_;
  gap_ = true;
}

// Takes the first piece of a newer frame than any before.
void FrameAssembly::expectUpTo(std::uint32_t number, std::uint64_t nowUs) {
  const std::uint32_t missing = number - end_;
  if (missing > kMaxMissing || number - next_ >= kMaxFrames) {
    while (next_ != end_) giveUp();
    statistics_.lostFrames += missing;
    gap_ = true;
    next_ = end_ = number;
  }
  for (; end_ != number; ++end_) expected(end_).noticedUs = nowUs;
  for (std::uint32_t older = next_; older != number; ++older)
    if (!expected(older).overtakenUs) expected(older).overtakenUs = nowUs;
  if (missing == 0 && number != 0) {
    const std::uint64_t interval = std::min(nowUs - newestUs_, kMaxIntervalUs);
    intervalUs_ += (static_cast<double>(interval) - intervalUs_) * kSmoothing;
  }
  expected(number).noticedUs = nowUs;
  end_ = number + 1;
  newestUs_ = nowUs;
  probed_ = false;
}

void FrameAssembly::add(const Piece& piece, std::uint64_t nowUs) {
  ++statistics_.pieces;
  reorderWindow_.add(piece.prefix.packet, nowUs);
  const std::uint32_t number = piece.prefix.frame;
  if (steps(next_, number) < 0) {
    ++statistics_.uselessPieces;
    return;
  }
  if (steps(end_, number) >= 0) expectUpTo(number, nowUs);
  Expected& frame = expected(number);
  switch (frame.pieces.add(piece)) {
    case PartialFrame::Added::useless:
      ++statistics_.uselessPieces;
      return;
    case PartialFrame::Added::stored:
      frame.newestPieceUs = nowUs;
      return;
    case PartialFrame::Added::completed:
      ++statistics_.frames;
      if (frame.pieces.usedParity() || frame.requestedUs) ++statistics_.repairedFrames;
      return;
  }
}

std::optional<AssembledFrame> FrameAssembly::next(std::uint64_t nowUs) {
  for (; next_ != end_; giveUp()) {
    Expected& frame = expected(next_);
    if (frame.pieces.isComplete()) {
      emitted_ = frame.pieces.takeMessage();
      frame = {};
      ++next_;
      return AssembledFrame{.message = emitted_, .afterGap = std::exchange(gap_, false)};
    }
    if (nowUs < frame.noticedUs + deadlineUs_) return std::nullopt;
  }
  return std::nullopt;
}

std::optional<PieceRequest> FrameAssembly::nextRequest(std::uint64_t nowUs) {
  for (std::uint32_t number = next_; number != end_; ++number) {
    Expected& frame = expected(number);
    if (frame.pieces.isComplete() || nowUs < requestUs(frame)) continue;
    frame.requestedUs = nowUs;
    ++statistics_.requests;
    return PieceRequest{.frame = number, .present = frame.pieces.present()};
  }
  if (probed_ || nowUs < probeUs()) return std::nullopt;
  probed_ = true;
  ++statistics_.requests;
  return PieceRequest{.frame = end_, .present = {}};
}

std::optional<std::uint64_t> FrameAssembly::dueUs() const {
  std::optional<std::uint64_t> due;
  const auto include = [&](std::uint64_t us) { due = due ? std::min(*due, us) : us; };
  if (next_ != end_) include(expected(next_).noticedUs + deadlineUs_);
  for (std::uint32_t number = next_; number != end_; ++number)
    if (!expected(number).pieces.isComplete()) include(requestUs(expected(number)));
  if (!probed_) include(probeUs());
  return due;
}

}  // namespace clothstream::datagram
