// SPDX-License-Identifier: MIT
#include "tests/monitoring/exposition.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <regex>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace clothstream::tests {
namespace {

[[noreturn]] void fail(const std::string& what, const std::string& where) {
  throw std::runtime_error(what + ": " + where);
}

double toNumber(const std::string& text, const std::string& line) {
  if (text == "+Inf" || text == "Inf") return std::numeric_limits<double>::infinity();
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) fail("not a number", line);
  return value;
}

// Reads {name="value",...} at the start of `rest`, and removes it.
MetricLabels readLabels(std::string_view& rest, const std::string& line) {
  MetricLabels labels;
  if (!rest.starts_with('{')) return labels;
  static const std::regex name("[a-zA-Z_][a-zA-Z0-9_]*");
  do {
    rest.remove_prefix(1);
    const std::size_t equals = rest.find("=\"");
    if (equals == std::string_view::npos) fail("label without value", line);
    const std::string label(rest.substr(0, equals));
    if (!std::regex_match(label, name)) fail("bad name of a label", line);
    rest.remove_prefix(equals + 2);
    std::string value;
    for (; !rest.empty() && rest.front() != '"'; rest.remove_prefix(1)) {
      if (rest.front() != '\\') {
        value += rest.front();
        continue;
      }
      rest.remove_prefix(1);
      if (rest.empty() || std::string_view("\\\"n").find(rest.front()) == std::string_view::npos)
        fail("unknown escape", line);
      value += rest.front() == 'n' ? '\n' : rest.front();
    }
    if (rest.empty()) fail("label without end", line);
    rest.remove_prefix(1);
    if (!labels.emplace(label, value).second) fail("the same label twice", line);
  } while (rest.starts_with(','));
  if (!rest.starts_with('}')) fail("labels without end", line);
  rest.remove_prefix(1);
  return labels;
}

MetricSample readSample(const std::string& line) {
  MetricSample sample;
  std::string_view rest = line;
  sample.name = rest.substr(0, rest.find_first_of("{ "));
  rest.remove_prefix(sample.name.size());
  sample.labels = readLabels(rest, line);
  if (!rest.starts_with(' ')) fail("no space before the value", line);
  sample.value = toNumber(std::string(rest.substr(1)), line);
  return sample;
}

void checkName(const std::string& name, const std::string& type) {
  static const std::regex allowed("clothstream_[a-z]+(_[a-z]+)*");
  if (!std::regex_match(name, allowed)) fail("bad name", name);
  if (name.ends_with("_total") != (type == "counter")) fail("only counters end with _total", name);
  if (type == "histogram" && !name.ends_with("_seconds")) fail("a histogram without unit", name);
  static const std::set<std::string> types{"counter", "gauge", "histogram"};
  if (!types.contains(type)) fail("unknown type " + type, name);
  for (const char* unit : {"milliseconds", "_ms", "kilobytes", "_mib", "percent"})
    if (name.find(unit) != std::string::npos) fail("not a base unit", name);
}

// Samples of one histogram series, in the order of the text.
struct Series {
  std::vector<std::pair<double, double>> buckets;  // upper bound, cumulative count
  std::optional<double> sum, count;
};

void checkHistogram(const std::string& name, const Series& series) {
  if (!series.sum || !series.count || series.buckets.empty()) fail("an incomplete histogram", name);
  double lower = 0, before = 0, atLeast = 0, atMost = 0;
  for (const auto& [upper, cumulative] : series.buckets) {
    if (upper <= lower) fail("bounds of buckets must rise", name);
    if (cumulative < before) fail("counts of buckets must not fall", name);
    atLeast += (cumulative - before) * lower;
    if (cumulative > before) atMost += (cumulative - before) * upper;
    lower = upper;
    before = cumulative;
  }
  if (!std::isinf(lower) || before != *series.count) fail("the last bucket must have all records", name);
  // Bounds are rounded to four digits.
  if (*series.sum < atLeast * 0.999 || *series.sum > atMost * 1.001) fail("the sum is not possible", name);
}

void checkFamily(const std::string& name, const ReadFamily& family) {
  std::set<std::pair<std::string, MetricLabels>> seen;
  std::map<MetricLabels, Series> histograms;
  for (const MetricSample& sample : family.samples) {
    if (!seen.emplace(sample.name, sample.labels).second) fail("the same series twice", sample.name);
    if (family.type != "histogram") {
      if (sample.name != name) fail("a sample of another family", sample.name);
      if (!std::isfinite(sample.value) || sample.value < 0) fail("not a count or size", sample.name);
      continue;
    }
    MetricLabels labels = sample.labels;
    const bool isBucket = labels.contains("le");
    const double bound = isBucket ? toNumber(labels["le"], name) : 0;
    labels.erase("le");
    Series& series = histograms[labels];
    if (sample.name == name + "_bucket" && isBucket)
      series.buckets.emplace_back(bound, sample.value);
    else if (sample.name == name + "_sum" && !isBucket)
      series.sum = sample.value;
    else if (sample.name == name + "_count" && !isBucket)
      series.count = sample.value;
    else
      fail("a sample of another family", sample.name);
  }
  for (const auto& [labels, series] : histograms) checkHistogram(name, series);
}

}  // namespace

Exposition::Exposition(const std::string& text) {
  if (!text.ends_with('\n')) fail("the last line has no end", text.substr(text.rfind('\n') + 1));
  std::string current;
  for (std::size_t at = 0, end; at < text.size(); at = end + 1) {
    end = text.find('\n', at);
    const std::string line = text.substr(at, end - at);
    if (line.starts_with("# HELP ")) {
      const std::size_t space = line.find(' ', 7);
      if (space == std::string::npos || space + 1 == line.size()) fail("no help", line);
      current = line.substr(7, space - 7);
      if (!families_.emplace(current, ReadFamily{.help = line.substr(space + 1), .type = {}, .samples = {}})
               .second)
        fail("the same family twice", line);
    } else if (line.starts_with("# TYPE " + current + " ")) {
      ReadFamily& family = families_.at(current);
      if (!family.type.empty()) fail("the type twice", line);
      family.type = line.substr(8 + current.size());
      checkName(current, family.type);
    } else if (line.starts_with('#') || current.empty() || families_.at(current).type.empty()) {
      fail("this line is not expected here", line);
    } else {
      families_.at(current).samples.push_back(readSample(line));
    }
  }
  for (const auto& [name, family] : families_) {
    if (family.type.empty()) fail("no type", name);
    checkFamily(name, family);
  }
}

std::optional<double> Exposition::find(const std::string& name, const MetricLabels& labels) const {
  for (const auto& [family, read] : families_)
    for (const MetricSample& sample : read.samples)
      if (sample.name == name && sample.labels == labels) return sample.value;
  return std::nullopt;
}

double Exposition::value(const std::string& name, const MetricLabels& labels) const {
  const std::optional<double> found = find(name, labels);
  if (!found) fail("no such sample", name);
  return *found;
}

bool Exposition::hasLabel(const std::string& name, const std::string& value) const {
  for (const auto& [family, read] : families_)
    for (const MetricSample& sample : read.samples)
      if (const auto label = sample.labels.find(name); label != sample.labels.end() && label->second == value)
        return true;
  return false;
}

}  // namespace clothstream::tests
