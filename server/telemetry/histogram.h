// SPDX-License-Identifier: MIT
// How long something took, over many times: quantiles from bins on a logarithmic axis.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace clothstream::telemetry {

// Seconds.
struct Summary {
  std::uint64_t count = 0;
  double p50 = 0, p90 = 0, p99 = 0, max = 0;
};

// Thread-safe, without locks; memory is taken once. From 1 microsecond to 1,000 seconds (what lies outside
// counts to the ends) with 48 bins a decade, so that a quantile is within 5 % of its true value; the maximum
// is exact.
class Histogram {
 public:
  Histogram();
  ~Histogram();
  Histogram(const Histogram&) = delete;
  Histogram& operator=(const Histogram&) = delete;

  void record(double seconds);
  Summary summary() const;

 private:
  struct Bins;
  std::unique_ptr<Bins> bins_;
};

// A histogram for each name, in order of first appearance. Thread-safe; memory is taken when a name is new.
class StageHistograms {
 public:
  // `stage` in static storage.
  void record(std::string_view stage, double seconds);
  std::vector<std::pair<std::string_view, Summary>> summaries() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::pair<std::string_view, std::unique_ptr<Histogram>>> stages_;
};

}  // namespace clothstream::telemetry
