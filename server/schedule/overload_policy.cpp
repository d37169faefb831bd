// SPDX-License-Identifier: MIT
#include "server/schedule/overload_policy.h"

#include <algorithm>
#include <utility>

namespace clothstream::schedule {

OverloadPolicy::OverloadPolicy(std::uint32_t streamRate, std::uint32_t substeps) {
  levels_.push_back({1, substeps});
  for (const std::uint32_t divisor : {2u, 4u})
    if (streamRate / divisor >= kLowestStreamRate) levels_.push_back({divisor, substeps});
  const std::uint32_t divisor = levels_.back().frameDivisor;
  for (const std::uint32_t quarters : {3u, 2u, 1u}) {
    const WorkLevel lower{divisor, (substeps * quarters + 3) / 4};
    if (lower != levels_.back()) levels_.push_back(lower);
  }
}

WorkLevel OverloadPolicy::at(std::size_t index, std::uint32_t leastSubsteps) const {
  WorkLevel level = levels_[index];
  level.substeps = std::clamp(leastSubsteps, level.substeps, levels_.front().substeps);
  return level;
}

WorkLevel OverloadPolicy::level(std::uint32_t leastSubsteps) const {
  return at(index_, leastSubsteps);
}

void OverloadPolicy::beginAt(const WorkLevel& work) {
  // Stability may have raised the substeps of the work above those of its level.
  const auto same = std::ranges::find_if(levels_, [&](const WorkLevel& level) {
    return level.frameDivisor >= work.frameDivisor && level.substeps <= work.substeps;
  });
  index_ = same == levels_.end() ? levels_.size() - 1 : static_cast<std::size_t>(same - levels_.begin());
  began_.reset();
}

void OverloadPolicy::begin(const Tick& tick) {
  if (!began_) calmSince_ = tick.now;
  began_ = tick.now;
  idleBefore_ = tick.idle;
  own_ = {};
  ticks_ = slipped_ = 0;
  disturbed_ = false;
  newest_ = judged_ = tick.now;
  newestIdle_ = tick.idle;
}

void OverloadPolicy::leaveOut(const Tick& tick) {
  const Clock::duration passed = tick.now - newest_;
  *began_ += passed;
  calmSince_ += passed;
  idleBefore_ += tick.idle - newestIdle_;
  newest_ = tick.now;
  newestIdle_ = tick.idle;
}

bool OverloadPolicy::note(const Tick& tick, std::uint32_t leastSubsteps) {
  if (!began_) {
    begin(tick);
    return false;
  }
  const bool leavesOut = tick.disturbed && tick.now - judged_ < kLongestDisturbance;
  const bool leftOut = std::exchange(disturbed_, leavesOut);
  if (leavesOut) {
    leaveOut(tick);
    return false;
  }
  ticks_ += 1;
  // Time that slips before the first tick after a disturbance is due to the disturbance.
  if (!leftOut) slipped_ += tick.slippedTicks;
  own_ += tick.own;
  newest_ = tick.now;
  newestIdle_ = tick.idle;
  if (tick.now - *began_ < kInterval) return false;
  const bool slow = ticks_ / (ticks_ + slipped_) < kSlow;
  const double own = seconds(own_) / ticks_, share = seconds(tick.share);
  bool changed = false;
  if (slow) {
    calmSince_ = tick.now;
    if (own > kMostUse * share) changed = stepDown(tick.now, leastSubsteps);
  } else {
    changed = stepUp(tick, leastSubsteps);
  }
  begin(tick);
  return changed;
}

bool OverloadPolicy::stepDown(Clock::time_point now, std::uint32_t leastSubsteps) {
  std::size_t lower = index_ + 1;
  while (lower < levels_.size() && at(lower, leastSubsteps) == level(leastSubsteps)) ++lower;
  if (lower == levels_.size()) return false;
  if (steppedUp_)
    pause_ = now - *steppedUp_ < 2 * pause_ ? std::min<Clock::duration>(2 * pause_, kLongestPause) : kPause;
  steppedUp_.reset();
  index_ = lower;
  return true;
}

bool OverloadPolicy::stepUp(const Tick& tick, std::uint32_t leastSubsteps) {
  if (index_ == 0 || tick.now - calmSince_ < pause_) return false;
  const WorkLevel present = level(leastSubsteps);
  std::size_t higher = index_ - 1;
  while (higher > 0 && at(higher, leastSubsteps) == present) --higher;
  const WorkLevel next = at(higher, leastSubsteps);
  const double growth = (next.frameDivisor < present.frameDivisor ? kFrameGrowth : 1) *
                        static_cast<double>(next.substeps) / present.substeps;
  const double own = seconds(own_) / ticks_;
  const double idle = seconds(tick.idle - idleBefore_) / ticks_;
  if (own * growth > kMostUseAfterStepUp * std::max(seconds(tick.share), own + idle)) return false;
  index_ = higher;
  calmSince_ = tick.now;
  steppedUp_ = tick.now;
  return true;
}

}  // namespace clothstream::schedule
