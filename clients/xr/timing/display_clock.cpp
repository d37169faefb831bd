// SPDX-License-Identifier: MIT
#include "clients/xr/timing/display_clock.h"

#include <algorithm>

namespace clothstream::xr {
namespace {

constexpr std::int64_t kUsualPeriodNs = 11'111'111;

std::uint64_t limited(std::int64_t us, std::uint64_t nowUs) {
  const auto now = static_cast<std::int64_t>(nowUs);
  return static_cast<std::uint64_t>(
      std::clamp(us, now, now + static_cast<std::int64_t>(DisplayClock::kLongestLeadUs)));
}

}  // namespace

std::uint64_t DisplayClock::displayUs(std::int64_t predictedNs, std::int64_t periodNs, std::uint64_t nowUs) {
  const std::int64_t period = periodNs > 0 ? periodNs : kUsualPeriodNs;
  const std::int64_t lead = predictedNs - static_cast<std::int64_t>(nowUs) * 1000;
  // A clock that jumps makes the older offsets worthless.
  constexpr std::int64_t kJumpNs = 1'000'000'000;
  if (count_ > 0) {
    const std::size_t newest = (next_ + kFrames - 1) % kFrames;
    if (lead - leads_[newest] > kJumpNs || leads_[newest] - lead > kJumpNs) count_ = next_ = 0;
  }
  leads_[next_] = lead;
  next_ = (next_ + 1) % kFrames;
  count_ = std::min(count_ + 1, kFrames);
  const std::int64_t largest =
      *std::max_element(leads_.begin(), leads_.begin() + static_cast<std::ptrdiff_t>(count_));
  return limited((predictedNs - largest + 2 * period) / 1000, nowUs);
}

std::uint64_t DisplayClock::convertedUs(std::int64_t monotonicNs, std::uint64_t nowUs) {
  return limited(monotonicNs / 1000, nowUs);
}

}  // namespace clothstream::xr
