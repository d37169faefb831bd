// SPDX-License-Identifier: MIT
#include "server/delivery/sent_packets.h"

#include <algorithm>
#include <cassert>

namespace clothstream::delivery {
namespace {

// `a` is a later number than `b`; numbers wrap (RFC 1982).
bool isLater(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::int32_t>(a - b) > 0;
}

}  // namespace

void SentPackets::add(std::uint32_t number, std::uint32_t bytes, Clock::time_point now) {
  if (packets_.empty()) first_ = number;
  assert(number == next());
  if (packets_.size() == kMost) removeFirst();
  packets_.push_back({.bytes = bytes, .sent = now, .arrivedBefore = arrived_, .arrivalUsBefore = arrivalUs_});
  inFlight_ += bytes;
}

std::optional<SentPackets::Report> SentPackets::receive(std::uint32_t newest, std::uint32_t arrivalUs,
                                                        std::uint64_t mask, Clock::duration reordering) {
  if (newest == next() || isLater(newest, next())) return std::nullopt;
  Report report;
  const std::uint32_t index = newest - first_;
  if (index >= packets_.size()) return report;  // settled
  const auto arrive = [&](Packet& packet) {
    if (packet.arrived) return;
    packet.arrived = true;
    report.bytes += packet.bytes;
    inFlight_ -= packet.bytes;
  };
  arrive(packets_[index]);
  for (std::uint32_t back = 1; back <= std::min(kMask, index); ++back)
    if ((mask >> (back - 1) & 1) != 0) arrive(packets_[index - back]);
  arrived_ += report.bytes;
  if (newest_ && !isLater(newest, *newest_)) return report;
  newest_ = newest;
  arrivalUs_ = arrivalUs;
  report.newest = packets_[index];

  // The newest packet stays, because its fate says nothing about those after it.
  for (std::uint32_t back = index; back > 0; --back) {
    const Packet& packet = packets_.front();
    const bool covered = back <= kMask;
    if (!packet.arrived && covered && report.newest->sent - packet.sent < reordering) break;
    ++report.packets;
    if (!packet.arrived) {
      ++report.lost;
      ++lost_;
      report.newestLost = first_;
    }
    loss_.add(!packet.arrived);
    removeFirst();
  }
  return report;
}

bool SentPackets::expire(Clock::time_point now) {
  bool expired = false;
  for (; !packets_.empty() && now - packets_.front().sent > kLongest; removeFirst())
    expired |= !packets_.front().arrived;
  return expired;
}

void SentPackets::removeFirst() {
  if (!packets_.front().arrived) inFlight_ -= packets_.front().bytes;
  packets_.pop_front();
  ++first_;
}

}  // namespace clothstream::delivery
