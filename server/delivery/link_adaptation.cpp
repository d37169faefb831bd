// SPDX-License-Identifier: MIT
#include "server/delivery/link_adaptation.h"

#include <algorithm>
#include <cmath>

namespace clothstream::delivery {
namespace {

// Time constant of the averaged rates, s.
constexpr double kAverageSeconds = 0.5;
// Longest time that one update() counts. A paused or slow scene says no more about a link than this.
constexpr std::chrono::milliseconds kLongestUpdate{250};

}  // namespace

void LinkAdaptation::made(std::uint8_t quality, std::size_t bytes, Clock::time_point now) {
  double kept = newestMade_ ? std::exp(-schedule::seconds(now - *newestMade_) / kAverageSeconds) : 1;
  if (quality != rateQuality_) kept *= std::pow(kCoarserRate, quality - rateQuality_);
  rate_ = rate_ * kept + static_cast<double>(bytes) / kAverageSeconds;
  rateQuality_ = quality;
  newestMade_ = now;
}

double LinkAdaptation::bytesPerSecond(std::uint8_t quality) const {
  return rate_ * std::pow(kCoarserRate, quality - rateQuality_);
}

bool LinkAdaptation::update(bool behind, Clock::time_point now, std::optional<double> linkRate) {
  // The calls come from several threads, so that `now` may be older than in the call before.
  const Clock::time_point newest = newestUpdate_.value_or(now);
  const Clock::duration passed =
      std::clamp<Clock::duration>(now - newest, Clock::duration::zero(), kLongestUpdate);
  newestUpdate_ = std::max(newest, now);
  const bool exceedsLink = linkRate && bytesPerSecond(quality_) > *linkRate;
  if (behind || exceedsLink)
    strain(passed, now - passed);
  else
    strain_ = std::max(strain_ - passed / 2, Clock::duration::zero());
  calm_ =
      strain_ == Clock::duration::zero() ? calm_ + passed : std::max(calm_ - passed, Clock::duration::zero());
  const std::uint8_t before = quality_;
  if (strain_ >= kPatience) stepDown(now, linkRate);
  const auto finerFits = [&] {
    return !linkRate ||
           bytesPerSecond(static_cast<std::uint8_t>(quality_ - 1)) <= kUsedThroughput * *linkRate;
  };
  if (wantsFiner() && calm_ >= wait_ && finerFits()) stepUp(now);
  return quality_ != before;
}

void LinkAdaptation::strain(Clock::duration more, Clock::time_point since) {
  if (strain_ == Clock::duration::zero()) {
    strainedSince_ = since;
    delivered_ = 0;
  }
  strain_ += more;
}

void LinkAdaptation::stepDown(Clock::time_point now, std::optional<double> linkRate) {
  calm_ = Clock::duration::zero();
  // There is no coarser quality. The strain is bounded, so that the way up does not take long.
  if (quality_ == coarsest_) {
    strain_ = kPatience;
    return;
  }
  const bool failed = steppedUp_ && now - *steppedUp_ < kTrial;
  backOff_ = failed ? std::min<Clock::duration>(2 * backOff_, kLongestWait) : kShortestWait;
  wait_ = backOff_;
  ++quality_;
  const double throughput = linkRate.value_or(static_cast<double>(delivered_) /
                                              std::max(schedule::seconds(now - strainedSince_), 1e-3));
  const double carried = kUsedThroughput * throughput;
  while (quality_ < coarsest_ && bytesPerSecond(quality_) > carried) ++quality_;
  strain_ = Clock::duration::zero();
}

void LinkAdaptation::stepUp(Clock::time_point now) {
  --quality_;
  steppedUp_ = now;
  wait_ = kClimb;
  calm_ = Clock::duration::zero();
}

}  // namespace clothstream::delivery
