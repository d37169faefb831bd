// SPDX-License-Identifier: MIT
#include "tests/gpu_kit/comparison.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace clothstream::gpu_kit {
namespace {

struct Suite {
  std::string name;
  std::vector<std::string> cases;  // keys that tell its rows apart
  std::vector<std::string> times;  // keys whose values should be small
  std::vector<std::string> rates;  // keys whose values should be large
};

const Suite& suiteOf(const Row& row) {
  static const std::vector<Suite> suites{
      {"acad", {"method", "coarse", "nodes"}, {"nsPerNodeSubstep"}, {}},
      {"batch", {"nodes", "scenes"}, {"deviceMsMedian", "tickMsMedian"}, {}},
      {"coarse",
       {"nodes", "substeps", "cells", "sweeps", "every", "levels", "ballSpeed"},
       {"nsPerNodeFrame"},
       {}},
      {"codec_device",
       {"nodes", "kind", "prediction", "normals", "maxErrorMm"},
       {"quantiseAndPredictMsMedian", "entropyMsMedian"},
       {}},
      {"colliders", {"size", "colliders", "touching"}, {"tickMsMedian"}, {}},
      {"doctor", {"topic", "scene", "method"}, {"tickMs"}, {}},
      {"enforcement", {"nodes", "workgroups"}, {}, {"framesPerSecond"}},
      {"mass_spring", {"size", "springDamping", "air", "spheres", "shape", "arithmetic"}, {"nsMedian"}, {}},
      {"paper",
       {"figure", "method", "nodes", "springs", "ballAndNormals", "compliance"},
       {},
       {"framesPerSecond"}},
      {"price", {"method", "size", "iterations"}, {"tick_ms"}, {}},
      {"self_collision", {"scene", "size", "lies", "selfCollision"}, {"nsMedian"}, {}},
      {"solvers", {"method", "nodes", "substeps"}, {"nsPerNodeSubstep"}, {}}};
  const auto found = std::ranges::find(suites, row.value("suite", ""), &Suite::name);
  if (found == suites.end())
    throw std::runtime_error(
        fmt::format("the times of suite '{}' are not known: add it to tests/gpu_kit/comparison.cpp",
                    row.value("suite", "")));
  return *found;
}

std::string caseOf(const Row& row) {
  std::string text;
  for (const std::string& key : suiteOf(row).cases)
    if (row.contains(key))
      text += fmt::format("{} {} {}", text.empty() ? ":" : ",", key,
                          row[key].is_string() ? row[key].get<std::string>() : row[key].dump());
  return row["suite"].get<std::string>() + text;
}

// Rows by their case and their number among equal cases.
std::map<std::pair<std::string, std::size_t>, const Row*> byCase(const Rows& rows) {
  std::map<std::string, std::size_t> counts;
  std::map<std::pair<std::string, std::size_t>, const Row*> sorted;
  for (const Row& row : rows) {
    const std::string name = caseOf(row);
    sorted[{name, counts[name]++}] = &row;
  }
  return sorted;
}

}  // namespace

Comparison compare(const Rows& before, const Rows& now) {
  Comparison comparison;
  const auto earlier = byCase(before);
  for (const auto& [name, row] : byCase(now)) {
    const auto found = earlier.find(name);
    if (found == earlier.end()) continue;
    const auto look = [&](const std::string& key, bool rate) {
      if (!row->contains(key) || !found->second->contains(key)) return;
      const double old = found->second->at(key).get<double>(), fresh = row->at(key).get<double>();
      if (!(old > 0) || !(fresh > 0)) return;
      const double times = rate ? old / fresh : fresh / old;
      ++comparison.figures;
      if (times * kNoticed < 1) ++comparison.faster;
      if (times > kNoticed) comparison.slower.push_back({name.first, key, old, fresh, times});
    };
    for (const std::string& key : suiteOf(*row).times) look(key, false);
    for (const std::string& key : suiteOf(*row).rates) look(key, true);
  }
  return comparison;
}

}  // namespace clothstream::gpu_kit
