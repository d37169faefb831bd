// SPDX-License-Identifier: MIT
#include "tests/mechanics/rows.h"

#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

namespace clothstream::mechanics {

std::string figure(double value) {
  return value == 0 ? "0" : fmt::format("{:.2g}", value);
}

void expectRow(const std::vector<std::string>& cells) {
  const std::ifstream file("docs/mechanics.md");
  std::ostringstream page;
  page << file.rdbuf();
  const std::string row = fmt::format("| {} |\n", fmt::join(cells, " | "));
  EXPECT_NE(page.str().find(row), std::string::npos) << "docs/mechanics.md has to have the row\n" << row;
}

}  // namespace clothstream::mechanics
