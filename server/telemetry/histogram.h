// SPDX-License-Identifier: MIT
// Histograms of durations, with quantiles from bins on a logarithmic axis.
#pragma once

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

 private:
  mutable std::mutex mutex_;
  std::vector<std::pair<std::string_view, std::unique_ptr<Histogram>>> stages_;
};

}  // namespace clothstream::telemetry
