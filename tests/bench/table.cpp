// SPDX-License-Identifier: MIT
// Rows of a benchmark as text.
#include "tests/bench/table.h"

#include <fmt/format.h>

namespace clothstream::bench {

void printTable(const Rows& rows) {
  for (const auto& row : rows) {
    std::string line;
    for (const auto& [key, value] : row.items()) {
      if (key == "device") continue;
      if (!line.empty()) line += "  ";
      if (value.is_number_float())
        line += fmt::format("{} {:.4g}", key, value.get<double>());
      else
        line += fmt::format("{} {}", key, value.is_string() ? value.get<std::string>() : value.dump());
    }
    fmt::print("{}\n", line);
  }
}

}  // namespace clothstream::bench
