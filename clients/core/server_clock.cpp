// SPDX-License-Identifier: MIT
// The clock filter: the shortest exchange of a window.
#include "clients/core/server_clock.h"

#include <algorithm>

namespace clothstream::client {

bool ServerClock::pingDue(std::uint64_t nowUs) const {
  if (pings_ == 0) return true;
  return nowUs - lastPingUs_ >= (pings_ < kWindow ? kFirstIntervalUs : kIntervalUs);
}

void ServerClock::pingSent(std::uint64_t nowUs) {
  unanswered_[pings_ % kWindow] = nowUs;
  lastPingUs_ = nowUs;
  ++pings_;
}

void ServerClock::pongReceived(const Pong& pong, std::uint64_t nowUs) {
  const auto ping = std::find(unanswered_.begin(), unanswered_.end(), pong.clientTimeUs);
  if (pong.clientTimeUs == 0 || ping == unanswered_.end() || nowUs < pong.clientTimeUs) return;
  *ping = 0;
  const std::uint64_t roundTrip = nowUs - pong.clientTimeUs;
  // The difference of two unsigned clocks, read as signed, is right whichever is ahead.
  const auto ahead = static_cast<std::int64_t>(pong.serverTimeUs - pong.clientTimeUs);
  exchanges_[exchangeCount_ % kWindow] = {roundTrip,
                                          static_cast<double>(ahead) - static_cast<double>(roundTrip) / 2};
  ++exchangeCount_;
}

const ServerClock::Exchange* ServerClock::best() const {
  const std::size_t count = std::min(exchangeCount_, kWindow);
  if (count == 0) return nullptr;
  return std::min_element(exchanges_.data(), exchanges_.data() + count,
                          [](const Exchange& a, const Exchange& b) { return a.roundTripUs < b.roundTripUs; });
}

double ServerClock::roundTripMs() const {
  const Exchange* exchange = best();
  return exchange ? static_cast<double>(exchange->roundTripUs) / 1000 : 0;
}

double ServerClock::offsetUs() const {
  const Exchange* exchange = best();
  return exchange ? exchange->offsetUs : 0;
}

}  // namespace clothstream::client
