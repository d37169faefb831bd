// SPDX-License-Identifier: MIT
#include "proto/sctp/received_tsns.h"

#include "proto/sctp/big_endian.h"

namespace clothstream::sctp {

ReceivedTsns::Arrival ReceivedTsns::add(std::uint32_t tsn) {
  if (!isBefore(cumulative_, tsn)) return Arrival::duplicate;
  if (tsn - cumulative_ > kWindow) return Arrival::tooFar;
  if (after_[tsn % kWindow]) return Arrival::duplicate;
  after_.set(tsn % kWindow);
  if (isBefore(highest_, tsn)) highest_ = tsn;
  advance();
  return Arrival::isNew;
}

bool ReceivedTsns::skipTo(std::uint32_t tsn) {
  if (!isBefore(cumulative_, tsn)) return false;
  if (tsn - cumulative_ >= kWindow) {
    after_.reset();
  } else {
    for (std::uint32_t i = cumulative_ + 1; i != tsn + 1; ++i) after_.reset(i % kWindow);
  }
  cumulative_ = tsn;
  if (isBefore(highest_, tsn)) highest_ = tsn;
  advance();
  return true;
}

void ReceivedTsns::advance() {
  while (after_[(cumulative_ + 1) % kWindow]) after_.reset(++cumulative_ % kWindow);
}

std::span<const GapBlock> ReceivedTsns::gapBlocks(GapBlocks& blocks) const {
  const std::uint32_t count = highest_ - cumulative_;
  std::size_t written = 0;
  for (std::uint32_t offset = 1; offset <= count; ++offset) {
    if (!after_[(cumulative_ + offset) % kWindow]) continue;
    const auto place = static_cast<std::uint16_t>(offset);
    if (written > 0 && blocks[written - 1].last + 1 == place) {
      blocks[written - 1].last = place;
    } else if (written == blocks.size()) {
      break;
    } else {
      blocks[written++] = {place, place};
    }
  }
  return std::span(blocks).first(written);
}

}  // namespace clothstream::sctp
