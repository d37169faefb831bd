// SPDX-License-Identifier: MIT
#include "server/delivery/queue_delay.h"

#include <algorithm>
#include <cmath>

namespace clothstream::delivery {
namespace {

constexpr double kMicro = 1e-6;
constexpr double kMostPassed = 0.02;      // s
constexpr double kJitterGain = 1.0 / 16;  // RFC 3550, section 6.4.1

}  // namespace

void QueueDelay::add(Clock::time_point sent, std::uint32_t arrivalUs, Clock::time_point now) {
  const std::uint32_t wrapped = arrivalUs - static_cast<std::uint32_t>(schedule::microseconds(sent));
  const std::int32_t change =
      oneWay_ ? static_cast<std::int32_t>(wrapped - static_cast<std::uint32_t>(*oneWay_)) : 0;
  oneWay_ = oneWay_.value_or(wrapped) + change;
  base_.add(*oneWay_, now);

  newest_ = kMicro * static_cast<double>(*oneWay_ - base_.value());
  // A queue grows at most as fast as time passes if the load is at most twice the rate. A stall of the radio
  // link, after which all packets arrive at once, therefore counts for little.
  const double passed = std::clamp(schedule::seconds(now - newestTime_), 0.0, kMostPassed);
  const double rise = std::min(newest_ - filtered_, passed);
  filtered_ = std::min(newest_, filtered_ + (1 - std::exp(-passed / kRise)) * rise);
  jitter_ += kJitterGain * (kMicro * std::abs(static_cast<double>(change)) - jitter_);
  newestTime_ = now;
}

}  // namespace clothstream::delivery
