// SPDX-License-Identifier: MIT
// Accuracy of quantiles, and concurrent recording.
#include "server/telemetry/histogram.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::telemetry {
namespace {

// Ratio of the two edges of a bin, with 48 bins per decade.
const double kBinRatio = std::pow(10.0, 1.0 / 48);

TEST(Histogram, IsEmptyAtFirst) {
  const Summary summary = Histogram().summary();
  EXPECT_EQ(summary.count, 0u);
  EXPECT_EQ(summary.max, 0);
}

TEST(Histogram, QuantilesAreWithinOneBinOfTheSortedValues) {
  Histogram histogram;
  std::mt19937 random(7);
  std::lognormal_distribution<double> durations(std::log(0.004), 1.2);
  std::vector<double> values(20'000);
  for (double& value : values) histogram.record(value = durations(random));
  std::ranges::sort(values);
  const auto exact = [&](double q) {
    return values[static_cast<std::size_t>(q * static_cast<double>(values.size())) - 1];
  };

  const Summary summary = histogram.summary();
  EXPECT_EQ(summary.count, values.size());
  EXPECT_EQ(summary.max, values.back());
  for (const auto& [q, value] : {std::pair{0.5, summary.p50}, {0.9, summary.p90}, {0.99, summary.p99}}) {
    EXPECT_LE(value, exact(q) * kBinRatio) << q;
    EXPECT_GE(value, exact(q) / kBinRatio) << q;
  }
}

TEST(Histogram, CountsValuesOutsideTheRangeInTheEndBins) {
  Histogram histogram;
  histogram.record(0);
  histogram.record(-1);
  histogram.record(5'000);
  const Summary summary = histogram.summary();
  EXPECT_EQ(summary.count, 3u);
  EXPECT_EQ(summary.max, 5'000);
  EXPECT_LE(summary.p50, 1e-6 * kBinRatio);
}

TEST(Histogram, BucketsCountTheRecordsUpToEachBound) {
  Histogram histogram;
  EXPECT_EQ(histogram.buckets().count, 0u);
  std::mt19937 random(7);
  std::lognormal_distribution<double> durations(std::log(0.004), 3);
  std::vector<double> values(20'000);
  for (double& value : values) histogram.record(value = durations(random));
  const Buckets buckets = histogram.buckets();
  EXPECT_EQ(buckets.count, values.size());
  EXPECT_NEAR(buckets.sum, std::accumulate(values.begin(), values.end(), 0.0), buckets.sum * 1e-12);
  for (std::size_t i = 0; i < kBucketBounds.size(); ++i) {
    // Bounds are rounded, so that records next to one may count on its other side.
    const auto upTo = [&](double bound) {
      return static_cast<std::uint64_t>(
          std::ranges::count_if(values, [&](double value) { return value <= bound; }));
    };
    EXPECT_GE(buckets.cumulative[i], upTo(kBucketBounds[i] * 0.999)) << kBucketBounds[i];
    EXPECT_LE(buckets.cumulative[i], upTo(kBucketBounds[i] * 1.001)) << kBucketBounds[i];
  }
}

TEST(Histogram, BucketsContainRecordsOutsideTheBounds) {
  Histogram histogram;
  for (const double seconds : {-1.0, 0.0, 1e-7, 20.0, 5'000.0}) histogram.record(seconds);
  const Buckets buckets = histogram.buckets();
  EXPECT_EQ(buckets.cumulative.front(), 3u);
  EXPECT_EQ(buckets.cumulative.back(), 3u);
  EXPECT_EQ(buckets.count, 5u);
  EXPECT_DOUBLE_EQ(buckets.sum, 5'020 + 1e-7);
}

TEST(Histogram, CountsEveryRecordOfConcurrentThreads) {
  Histogram histogram;
  StageHistograms stages;
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 4; ++thread)
    threads.emplace_back([&] {
      for (int i = 1; i <= 1'000; ++i) {
        histogram.record(i * 1e-5);
        stages.record(i % 2 == 0 ? "springs" : "normals", i * 1e-5);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(histogram.summary().count, 4'000u);
  EXPECT_DOUBLE_EQ(histogram.summary().max, 0.01);
  EXPECT_EQ(histogram.buckets().cumulative.back(), 4'000u);
  EXPECT_NEAR(histogram.buckets().sum, 4 * 1e-5 * 500'500, 1e-9);
  ASSERT_EQ(stages.summaries().size(), 2u);
  for (const auto& [stage, summary] : stages.summaries()) EXPECT_EQ(summary.count, 2'000u) << stage;
  for (const auto& [stage, buckets] : stages.buckets()) EXPECT_EQ(buckets.count, 2'000u) << stage;
}

}  // namespace
}  // namespace clothstream::telemetry
