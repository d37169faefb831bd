// SPDX-License-Identifier: MIT
#include "server/delivery/send_window.h"

#include <algorithm>
#include <cmath>

namespace clothstream::delivery {

std::size_t SendWindow::size(std::uint32_t rate) const {
  const double inFlight = std::ceil(roundTrip_.value_or(0) * rate) + (leavesOut_ ? 1 : 0);
  return kMin + static_cast<std::size_t>(std::min(inFlight, double{kMax - kMin}));
}

void SendWindow::send(const Sent& frame) {
  sent_.push_back(frame);
  newest_ = newestEver_ = frame.tick;
}

std::optional<std::size_t> SendWindow::acknowledge(std::uint64_t tick, Clock::time_point now) {
  if (tick > newestEver_) return std::nullopt;
  if (!sent_.empty() && sent_.front().tick <= tick) leavesOut_ = sent_.front().tick < tick;
  std::size_t bytes = 0;
  while (!sent_.empty() && sent_.front().tick <= tick) {
    bytes += sent_.front().bytes;
    // A minimum that grows slowly (by half in about 200 frames), so that a longer route is noticed.
    if (roundTrip_) *roundTrip_ *= 1.002;
    if (sent_.front().tick == tick) {
      const double sample = schedule::seconds(now - sent_.front().time);
      roundTrip_ = roundTrip_ ? std::min(sample, *roundTrip_) : sample;
    }
    sent_.pop_front();
  }
  return bytes;
}

void SendWindow::restart() {
  abandon();
  newest_.reset();
}

void SendWindow::abandon() {
  sent_.clear();
  leavesOut_ = false;
}

}  // namespace clothstream::delivery
