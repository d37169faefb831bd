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
// Share of the measured throughput that frames may use; the rest is for control messages.
constexpr double kUsedThroughput = 0.9;

}  // namespace

LinkAdaptation::LinkAdaptation(OperatingPoint best, std::uint8_t qualities) {
  for (std::uint8_t layers = best.layers; layers > 1; --layers) points_.push_back({best.quality, layers});
  for (std::uint8_t quality = best.quality; quality < qualities; ++quality) points_.push_back({quality, 1});
}

void LinkAdaptation::made(std::uint8_t quality, std::uint8_t layer, std::size_t bytes,
                          Clock::time_point now) {
  double kept = newestMade_ ? std::exp(-schedule::seconds(now - *newestMade_) / kAverageSeconds) : 1;
  if (quality != ratesQuality_) kept *= std::pow(kCoarserRate, quality - ratesQuality_);
  for (double& rate : rates_) rate *= kept;
  rates_[layer] += static_cast<double>(bytes) / kAverageSeconds;
  ratesQuality_ = quality;
  newestMade_ = now;
}

double LinkAdaptation::bytesPerSecond(const OperatingPoint& point) const {
  double rate = 0;
  for (std::uint8_t layer = 0; layer < point.layers; ++layer) rate += rates_[layer];
  return rate * std::pow(kCoarserRate, point.quality - ratesQuality_);
}

bool LinkAdaptation::update(bool behind, Clock::time_point now) {
  // The calls come from several threads, so that `now` may be older than in the call before.
  const Clock::time_point newest = newestUpdate_.value_or(now);
  const Clock::duration passed =
      std::clamp<Clock::duration>(now - newest, Clock::duration::zero(), kLongestUpdate);
  newestUpdate_ = std::max(newest, now);
  if (behind)
    strain(passed, now - passed);
  else
    strain_ = std::max(strain_ - passed / 2, Clock::duration::zero());
  calm_ =
      strain_ == Clock::duration::zero() ? calm_ + passed : std::max(calm_ - passed, Clock::duration::zero());
  const std::size_t before = step_;
  if (strain_ >= kPatience) stepDown(now);
  if (step_ > 0 && calm_ >= wait_) stepUp(now);
  return step_ != before;
}

void LinkAdaptation::strain(Clock::duration more, Clock::time_point since) {
  if (strain_ == Clock::duration::zero()) {
    strainedSince_ = since;
    delivered_ = 0;
  }
  strain_ += more;
}

void LinkAdaptation::stepDown(Clock::time_point now) {
  const std::size_t last = points_.size() - 1;
  calm_ = Clock::duration::zero();
  // There is no lower point. The strain is bounded, so that the way up does not take long.
  if (step_ == last) {
    strain_ = kPatience;
    return;
  }
  const bool failed = steppedUp_ && now - *steppedUp_ < kTrial;
  backOff_ = failed ? std::min<Clock::duration>(2 * backOff_, kLongestWait) : kShortestWait;
  wait_ = backOff_;
  ++step_;
  const double carried = kUsedThroughput * static_cast<double>(delivered_) /
                         std::max(schedule::seconds(now - strainedSince_), 1e-3);
  while (step_ < last && bytesPerSecond(points_[step_]) > carried) ++step_;
  strain_ = Clock::duration::zero();
}

void LinkAdaptation::stepUp(Clock::time_point now) {
  --step_;
  steppedUp_ = now;
  wait_ = kClimb;
  calm_ = Clock::duration::zero();
}

}  // namespace clothstream::delivery
