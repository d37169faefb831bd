// SPDX-License-Identifier: MIT
// How much of a stream one subscriber is sent.
#include "server/stream/link_adaptation.h"

#include <algorithm>
#include <cmath>

namespace clothstream::stream {
namespace {

// Over which rates are averaged, s.
constexpr double kAverageSeconds = 0.5;
// A scene that stood still, or streams slowly, says no more of a link than this in one look.
constexpr std::chrono::milliseconds kLongestLook{250};
// Of what arrived while the link was too slow; the rest is left for what else travels.
constexpr double kPartUsed = 0.9;

}  // namespace

LinkAdaptation::LinkAdaptation(OperatingPoint best, std::uint8_t qualities) {
  for (std::uint8_t layers = best.layers; layers > 1; --layers) points_.push_back({best.quality, layers});
  for (std::uint8_t quality = best.quality; quality < qualities; ++quality) points_.push_back({quality, 1});
}

void LinkAdaptation::made(std::uint8_t quality, std::uint8_t layer, std::size_t bytes,
                          Clock::time_point now) {
  double kept = newestMade_ ? std::exp(-seconds(now - *newestMade_) / kAverageSeconds) : 1;
  if (quality != ratesQuality_) kept *= std::pow(kPartOfFiner, quality - ratesQuality_);
  for (double& rate : rates_) rate *= kept;
  rates_[layer] += static_cast<double>(bytes) / kAverageSeconds;
  ratesQuality_ = quality;
  newestMade_ = now;
}

double LinkAdaptation::bytesPerSecond(const OperatingPoint& point) const {
  double rate = 0;
  for (std::uint8_t layer = 0; layer < point.layers; ++layer) rate += rates_[layer];
  return rate * std::pow(kPartOfFiner, point.quality - ratesQuality_);
}

bool LinkAdaptation::look(bool behind, Clock::time_point now) {
  // Those who tell it are not of one thread.
  const Clock::time_point newest = newestLook_.value_or(now);
  const Clock::duration passed =
      std::clamp<Clock::duration>(now - newest, Clock::duration::zero(), kLongestLook);
  newestLook_ = std::max(newest, now);
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
  // There is no lower one: but it is not to take long to come back from here.
  if (step_ == last) {
    strain_ = kPatience;
    return;
  }
  const bool failed = steppedUp_ && now - *steppedUp_ < kTrial;
  backOff_ = failed ? std::min<Clock::duration>(2 * backOff_, kLongestWait) : kShortestWait;
  wait_ = backOff_;
  ++step_;
  const double carried =
      kPartUsed * static_cast<double>(delivered_) / std::max(seconds(now - strainedSince_), 1e-3);
  while (step_ < last && bytesPerSecond(points_[step_]) > carried) ++step_;
  strain_ = Clock::duration::zero();
}

void LinkAdaptation::stepUp(Clock::time_point now) {
  --step_;
  steppedUp_ = now;
  wait_ = kClimb;
  calm_ = Clock::duration::zero();
}

}  // namespace clothstream::stream
