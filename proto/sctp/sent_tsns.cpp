// SPDX-License-Identifier: MIT
#include "proto/sctp/sent_tsns.h"

#include <utility>

#include "proto/sctp/big_endian.h"

namespace clothstream::sctp {

bool SentTsns::hasRoom(Time now) {
  if (now - heard_ >= kSilence) seen_ = newest();
  const std::uint64_t inFlight = newest() - seen_;
  return inFlight == 0 || (inFlight + 1) * kMaxPayloadBytes <= window_;
}

std::uint32_t SentTsns::take(Time now) {
  if (seen_ == newest()) heard_ = now;
  return next_++;
}

void SentTsns::keep(const Data& data) {
  kept_.push_back({data, {data.payload.begin(), data.payload.end()}});
  kept_.back().data.payload = {};
}

bool SentTsns::acknowledge(Time now, const Sack& sack) {
  if (isBefore(sack.cumulative, acknowledged_) || isBefore(newest(), sack.cumulative) ||
      isBefore(newest(), sack.highest))
    return false;
  acknowledged_ = sack.cumulative;
  if (isBefore(seen_, sack.highest)) seen_ = sack.highest;
  window_ = sack.window;
  heard_ = now;
  std::erase_if(kept_, [&](const Kept& kept) { return !isBefore(acknowledged_, kept.data.tsn); });
  if (sack.highest == sack.cumulative) {
    giveUpAt_ = kNever;
  } else if (giveUpAt_ == kNever || !isBefore(acknowledged_, giveUpTo_)) {
    giveUpTo_ = sack.highest;
    giveUpAt_ = now + patience_;
  }
  return true;
}

std::optional<std::uint32_t> SentTsns::giveUp(Time now) {
  if (now < giveUpAt_) return std::nullopt;
  giveUpAt_ = kNever;
  std::uint32_t to = giveUpTo_;
  for (const Kept& kept : kept_)
    if (!isBefore(to, kept.data.tsn)) to = kept.data.tsn - 1;
  if (!isBefore(acknowledged_, to)) return std::nullopt;
  return to;
}

}  // namespace clothstream::sctp
