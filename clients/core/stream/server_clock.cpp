// SPDX-License-Identifier: MIT
// Fits a line through the exchanges with the shortest round trips.
#include "clients/core/stream/server_clock.h"

#include <algorithm>
#include <cmath>

namespace clothstream::client {

bool ServerClock::pingDue(std::uint64_t nowUs) const {
  return !pinged_ || nowUs - lastPingUs_ >= (burst_ > 0 ? kFirstIntervalUs : kIntervalUs);
}

void ServerClock::pingSent(std::uint64_t nowUs) {
  pending_[nextPending_++ % kPending] = nowUs;
  lastPingUs_ = nowUs;
  pinged_ = true;
  if (burst_ > 0) --burst_;
}

void ServerClock::pongReceived(const Pong& pong, std::uint64_t nowUs) {
  const auto ping = std::find(pending_.begin(), pending_.end(), pong.clientTimeUs);
  if (pong.clientTimeUs == 0 || ping == pending_.end() || nowUs < pong.clientTimeUs) return;
  *ping = 0;
  const std::uint64_t roundTrip = nowUs - pong.clientTimeUs;
  const Exchange exchange{
      .atUs = pong.clientTimeUs + roundTrip / 2,
      .roundTripUs = roundTrip,
      .offsetUs = since(pong.clientTimeUs, pong.serverTimeUs) - static_cast<double>(roundTrip) / 2};
  const bool first = !known();
  const double shown = offsetUs(nowUs);
  if (!contradicts(exchange)) {
    suspects_.clear();
    add(exchange);
  } else {
    suspects_.push_back(exchange);
    if (suspects_.size() < kSuspects) return;
    exchanges_.clear();
    for (const Exchange& suspect : suspects_) add(suspect);
    suspects_.clear();
    burst_ = kBurst;
  }
  fit();
  const double now = line_.at(nowUs);
  shownUs_ = first || std::abs(now - shown) > kJumpUs ? now : shown;
  shownAtUs_ = nowUs;
}

bool ServerClock::contradicts(const Exchange& exchange) const {
  return known() && std::abs(exchange.offsetUs - line_.at(exchange.atUs)) >
                        static_cast<double>(exchange.roundTripUs) / 2 + kToleranceUs;
}

void ServerClock::add(const Exchange& exchange) {
  exchanges_.push_back(exchange);
  while (exchanges_.size() > kMaxExchanges || since(exchanges_.front().atUs, exchange.atUs) > kWindowUs)
    exchanges_.pop_front();
}

void ServerClock::fit() {
  trips_.clear();
  for (const Exchange& exchange : exchanges_) trips_.push_back(exchange.roundTripUs);
  const auto quarter = trips_.begin() + static_cast<std::ptrdiff_t>((trips_.size() - 1) / 4);
  std::nth_element(trips_.begin(), quarter, trips_.end());
  const std::uint64_t longest = *quarter;

  // Values are relative to the newest exchange, so that squares keep their precision.
  const Exchange& origin = exchanges_.back();
  double count = 0, t = 0, y = 0, tt = 0, ty = 0, yy = 0;
  for (const Exchange& exchange : exchanges_) {
    if (exchange.roundTripUs > longest) continue;
    const double time = since(origin.atUs, exchange.atUs), offset = exchange.offsetUs - origin.offsetUs;
    count += 1;
    t += time;
    y += offset;
    tt += time * time;
    ty += time * offset;
    yy += offset * offset;
  }
  t /= count;
  y /= count;
  tt -= count * t * t;
  ty -= count * t * y;
  yy -= count * y * y;
  // Least squares with the typical drift as prior: a few seconds of jitter say little about the drift,
  // minutes say enough.
  constexpr double kLeastVariance = 100.0 * 100.0;
  const double variance = std::max(kLeastVariance, (tt > 0 ? yy - ty * ty / tt : yy) / count);
  const double slope = ty / (tt + variance / (kDrift * kDrift));
  line_ = {.atUs = origin.atUs, .offsetUs = origin.offsetUs + y - slope * t, .slope = slope};
}

double ServerClock::Line::at(std::uint64_t nowUs) const {
  return offsetUs + slope * std::max(0.0, since(atUs, nowUs));
}

double ServerClock::roundTripMs() const {
  std::uint64_t shortest = 0;
  const std::size_t first = exchanges_.size() - std::min(exchanges_.size(), kRecent);
  for (std::size_t i = first; i < exchanges_.size(); ++i)
    shortest = i == first ? exchanges_[i].roundTripUs : std::min(shortest, exchanges_[i].roundTripUs);
  return static_cast<double>(shortest) / 1000;
}

double ServerClock::offsetUs(std::uint64_t nowUs) const {
  if (!known()) return 0;
  const double most = kSlew * std::max(0.0, since(shownAtUs_, nowUs));
  return shownUs_ + std::clamp(line_.at(nowUs) - shownUs_, -most, most);
}

std::uint64_t ServerClock::serverTimeUs(std::uint64_t nowUs) const {
  // The offset may be negative; unsigned wrap-around gives the right sum.
  return known() ? nowUs + static_cast<std::uint64_t>(std::llround(offsetUs(nowUs))) : 0;
}

}  // namespace clothstream::client
