// SPDX-License-Identifier: MIT
// Strict reader of Prometheus' text format, for tests.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace clothstream::tests {

using MetricLabels = std::map<std::string, std::string>;

struct MetricSample {
  std::string name;  // with _bucket, _sum or _count
  MetricLabels labels;
  double value = 0;
};

struct ReadFamily {
  std::string help, type;
  std::vector<MetricSample> samples;
};

// Families by name.
class Exposition {
 public:
  // Throws std::runtime_error, which names the line, unless the text has exactly the form that TextSerializer
  // promises and the metrics follow the naming rules of docs/monitoring.md: prefix, units, _total for
  // counters alone, unique series, finite counters, and histograms whose buckets, sum and count agree.
  explicit Exposition(const std::string& text);

  const std::map<std::string, ReadFamily>& families() const { return families_; }
  // Value of the sample with exactly these labels.
  std::optional<double> find(const std::string& name, const MetricLabels& labels = {}) const;
  // Same as find(). Throws std::runtime_error if there is none.
  double value(const std::string& name, const MetricLabels& labels = {}) const;
  // Whether a sample has this label.
  bool hasLabel(const std::string& name, const std::string& value) const;

 private:
  std::map<std::string, ReadFamily> families_;
};

}  // namespace clothstream::tests
