// SPDX-License-Identifier: MIT
#include "proto/datagram/sent_frames.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace clothstream::datagram {

std::uint32_t SentFrames::add(std::shared_ptr<const FramePieces> frame, unsigned pieces,
                              std::uint64_t nowUs) {
  assert(pieces <= frame->pieces());
  budget_ = std::min(kMaxBudget, budget_ + pieces * frame->datagramBytes() / 2);
  storedBytes_ += frame->storedBytes();
  sent_.push_back({std::move(frame), nowUs});
  while (sent_.size() > 1 &&
         (sent_.size() > kMaxFrames || storedBytes_ > kMaxBytes || nowUs - sent_.front().sentUs > kKeptUs))
    forget();
  return next_++;
}

void SentFrames::forget() {
  storedBytes_ -= sent_.front().frame->storedBytes();
  sent_.pop_front();
}

std::optional<SentFrames::Repeat> SentFrames::answer(const PieceRequest& request, std::uint64_t nowUs) {
  const std::uint32_t age = next_ - 1 - request.frame;  // 0 for the newest frame
  if (age >= sent_.size()) return std::nullopt;
  const Sent& sent = sent_[sent_.size() - 1 - age];
  if (nowUs - sent.sentUs > kKeptUs) return std::nullopt;

  const FramePieces& frame = *sent.frame;
  unsigned present = 0;
  for (unsigned i = 0; i < frame.pieces(); ++i) present += request.present[i] ? 1 : 0;
  if (present >= frame.dataPieces()) return std::nullopt;

  Repeat repeat{.frame = sent.frame, .number = request.frame, .pieces = {}};
  unsigned wanted = frame.dataPieces() - present + 1;
  for (unsigned i = 0; i < frame.pieces() && wanted > 0 && budget_ >= frame.datagramBytes(); ++i) {
    if (request.present[i]) continue;
    repeat.pieces[i] = true;
    budget_ -= frame.datagramBytes();
    --wanted;
  }
  if (repeat.pieces.none()) return std::nullopt;
  return repeat;
}

}  // namespace clothstream::datagram
