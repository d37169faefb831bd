// SPDX-License-Identifier: MIT
// Comparison of the times that two runs of clothstream-bench measured.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace clothstream::gpu_kit {

using Row = nlohmann::ordered_json;
using Rows = std::vector<Row>;

// A time is slower if it grew by more than this factor, and faster if it shrank by more.
inline constexpr double kNoticed = 1.25;

struct Slower {
  std::string row;     // its suite, and what tells it apart from other rows
  std::string figure;  // key of the time or rate
  double before = 0;
  double now = 0;
  double times = 0;  // as long as before
};

struct Comparison {
  std::size_t figures = 0;  // that both runs have
  std::size_t faster = 0;
  std::vector<Slower> slower;
};

// Rows of both runs belong together if they have the same suite and case. Of equal cases, the first belongs
// to the first, and so on. Throws std::runtime_error for a suite whose times are not known.
Comparison compare(const Rows& before, const Rows& now);

}  // namespace clothstream::gpu_kit
