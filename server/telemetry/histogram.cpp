// SPDX-License-Identifier: MIT
// Histograms and quantiles, with an axis of Boost.Histogram.
#include "server/telemetry/histogram.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <boost/histogram/axis/regular.hpp>

namespace clothstream::telemetry {
namespace {

namespace bh = boost::histogram;

constexpr double kShortest = 1e-6, kLongest = 1e3;
constexpr unsigned kBinsPerDecade = 48, kDecades = 9;
// Bins below the first bound of kBucketBounds, and between two bounds.
constexpr std::size_t kBinsBelowFirstBound = kBinsPerDecade, kBinsPerBucket = kBinsPerDecade / 3;

using Axis = bh::axis::regular<double, bh::axis::transform::log>;

}  // namespace

struct Histogram::Bins {
  Axis axis{kBinsPerDecade * kDecades, kShortest, kLongest};
  // The first and the last count are of values outside the axis. Boost's own thread-safe counters have
  // different names in its versions.
  std::array<std::atomic<std::uint64_t>, kBinsPerDecade * kDecades + 2> counts{};
  std::atomic<double> max{0}, sum{0};

  void count(double seconds) {
    counts[static_cast<std::size_t>(axis.index(seconds) + 1)].fetch_add(1, std::memory_order_relaxed);
  }

  // A copy of the counts while other threads record.
  std::vector<std::uint64_t> snapshot() const {
    std::vector<std::uint64_t> now;
    for (const auto& count : counts) now.push_back(count.load(std::memory_order_relaxed));
    return now;
  }
};

Histogram::Histogram() : bins_(std::make_unique<Bins>()) {}
Histogram::~Histogram() = default;

void Histogram::record(double seconds) {
  bins_->count(std::clamp(seconds, kShortest, kLongest));
  bins_->sum.fetch_add(std::max(seconds, 0.0), std::memory_order_relaxed);
  double max = bins_->max.load(std::memory_order_relaxed);
  while (seconds > max && !bins_->max.compare_exchange_weak(max, seconds, std::memory_order_relaxed)) {
  }
}

Summary Histogram::summary() const {
  const Axis& axis = bins_->axis;
  const std::vector<std::uint64_t> counts = bins_->snapshot();

  Summary summary;
  for (const std::uint64_t count : counts) summary.count += count;
  if (summary.count == 0) return summary;
  summary.max = bins_->max.load(std::memory_order_relaxed);

  const auto quantile = [&](double q) {
    const double wanted = q * static_cast<double>(summary.count);
    double before = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const double count = static_cast<double>(counts[i]);
      if (count > 0 && before + count >= wanted)
        return std::min(axis.value(static_cast<double>(i) - 1 + (wanted - before) / count), summary.max);
      before += count;
    }
    return summary.max;
  };
  summary.p50 = quantile(0.5);
  summary.p90 = quantile(0.9);
  summary.p99 = quantile(0.99);
  return summary;
}

Buckets Histogram::buckets() const {
  Buckets buckets;
  const std::vector<std::uint64_t> counts = bins_->snapshot();
  std::size_t bin = 0;
  for (std::size_t i = 0; i < buckets.cumulative.size(); ++i) {
    // Index 0 has the values below the axis.
    for (const std::size_t end = 1 + kBinsBelowFirstBound + i * kBinsPerBucket; bin < end; ++bin)
      buckets.count += counts[bin];
    buckets.cumulative[i] = buckets.count;
  }
  for (; bin < counts.size(); ++bin) buckets.count += counts[bin];
  buckets.sum = bins_->sum.load(std::memory_order_relaxed);
  return buckets;
}

void StageHistograms::record(std::string_view stage, double seconds) {
  const std::lock_guard lock(mutex_);
  auto found = std::ranges::find(stages_, stage, [](const auto& entry) { return entry.first; });
  if (found == stages_.end()) found = stages_.insert(found, {stage, std::make_unique<Histogram>()});
  found->second->record(seconds);
}

std::vector<std::pair<std::string_view, Summary>> StageHistograms::summaries() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::pair<std::string_view, Summary>> all;
  for (const auto& [stage, histogram] : stages_) all.emplace_back(stage, histogram->summary());
  return all;
}

std::vector<std::pair<std::string_view, Buckets>> StageHistograms::buckets() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::pair<std::string_view, Buckets>> all;
  for (const auto& [stage, histogram] : stages_) all.emplace_back(stage, histogram->buckets());
  return all;
}

}  // namespace clothstream::telemetry
