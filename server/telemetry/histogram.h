// SPDX-License-Identifier: MIT
// Histograms of durations, with quantiles from bins on a logarithmic axis.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace clothstream::telemetry {

// Times in seconds. All are 0 if nothing was recorded.
struct Summary {
  std::uint64_t count = 0;
  double p50 = 0, p90 = 0, p99 = 0, max = 0;
};

// Upper bounds of the buckets, in seconds. Each is the upper edge of a bin, rounded to four digits.
inline constexpr std::array<double, 19> kBucketBounds{
    1e-5,    2.154e-5, 4.642e-5, 1e-4,   2.154e-4, 4.642e-4, 1e-3,  2.154e-3, 4.642e-3, 0.01,
    0.02154, 0.04642,  0.1,      0.2154, 0.4642,   1,        2.154, 4.642,    10};

// Numbers of records up to each bound, and of all records.
struct Buckets {
  std::array<std::uint64_t, kBucketBounds.size()> cumulative{};
  std::uint64_t count = 0;
  double sum = 0;  // seconds
};

// Thread-safe without locks; allocates only when constructed. Range: 1 microsecond to 1,000 seconds; values
// outside count in the first or the last bin. 48 bins per decade keep a quantile within 5 % of its true
// value. The maximum is exact.
class Histogram {
 public:
  Histogram();
  ~Histogram();
  Histogram(const Histogram&) = delete;
  Histogram& operator=(const Histogram&) = delete;

  void record(double seconds);
  // Quantiles and count belong to one snapshot, also while other threads record.
  Summary summary() const;
  // The counts belong to one snapshot. The sum may contain records that the counts do not contain yet, or the
  // reverse. Negative records add 0 to the sum.
  Buckets buckets() const;

 private:
  struct Bins;
  std::unique_ptr<Bins> bins_;
};

// One histogram per stage, in the order of their first records. Thread-safe; allocates when a stage is new.
class StageHistograms {
 public:
  // `stage` must have static storage duration.
  void record(std::string_view stage, double seconds);
  std::vector<std::pair<std::string_view, Summary>> summaries() const;
  std::vector<std::pair<std::string_view, Buckets>> buckets() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::pair<std::string_view, std::unique_ptr<Histogram>>> stages_;
};

}  // namespace clothstream::telemetry
