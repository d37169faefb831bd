// SPDX-License-Identifier: MIT
// Compares tables of FRAME_FORMAT.md with the codec: those of the residuals, and the order of a mesh.
#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/hierarchical/coding_order.h"
#include "proto/codec/hierarchical/residual_model.h"

namespace clothstream::codec::hierarchical {
namespace {

using Cells = std::vector<std::string>;
using Numbers = std::vector<int>;

Cells cellsOf(const std::string& line) {
  Cells cells;
  for (std::size_t from = 1; from < line.size();) {
    const std::size_t end = line.find('|', from);
    if (end == std::string::npos) break;
    std::string cell = line.substr(from, end - from);
    cell.erase(0, cell.find_first_not_of(' '));
    cell.erase(cell.find_last_not_of(' ') + 1);
    cells.push_back(std::move(cell));
    from = end + 1;
  }
  return cells;
}

bool isNumber(const std::string& cell, int& number) {
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), number);
  return error == std::errc{} && end == cell.data() + cell.size();
}

// Reads all rows of `width` cells that hold numbers from the third cell on. The first two cells are the key.
std::map<std::pair<std::string, std::string>, Numbers> readTable(std::size_t width) {
  std::map<std::pair<std::string, std::string>, Numbers> table;
  std::ifstream page("proto/FRAME_FORMAT.md");
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with('|')) continue;
    const Cells cells = cellsOf(line);
    if (cells.size() != width) continue;
    Numbers numbers(width - 2);
    bool isRow = true;
    for (std::size_t i = 2; i < width; ++i) isRow = isRow && isNumber(cells[i], numbers[i - 2]);
    if (isRow) {
      EXPECT_TRUE(table.emplace(std::pair(cells[0], cells[1]), numbers).second) << line;
    }
  }
  return table;
}

TEST(FrameFormat, ScaleWeightsEqualResidualTables) {
  const auto table = readTable(8);
  ASSERT_EQ(table.size(), kScaleClasses * kComponents);
  const std::map<std::string, Component> components{{"u", kAlongU}, {"v", kAlongV}, {"n", kAlongNormal}};
  for (const auto& [key, row] : table) {
    const ScaleWeights& w = kScaleWeights.at(std::stoul(key.first))[components.at(key.second)];
    EXPECT_EQ(row, (Numbers{w.parents, w.ring, w.last, w.normal, w.u, w.constant}))
        << key.first << ' ' << key.second;
  }
}

TEST(FrameFormat, DistributionsEqualResidualTables) {
  const auto table = readTable(2 + kSymbols);
  ASSERT_EQ(table.size(), kDistributions.size());
  const std::map<std::string, Component> components{{"u, v", kAlongU}, {"n", kAlongNormal}};
  for (const auto& [key, row] : table) {
    const std::size_t place =
        distributionOf(components.at(key.first), static_cast<std::uint32_t>(std::stoul(key.second)));
    const Distribution& distribution = kDistributions.at(place);
    EXPECT_EQ(row, Numbers(distribution.begin(), distribution.end())) << key.first << ' ' << key.second;
  }
}

// Whole numbers between spaces and commas; -1 for a dash, which is the origin.
Numbers numbersOf(std::string text) {
  std::ranges::replace(text, ',', ' ');
  std::istringstream words(text);
  Numbers numbers;
  for (std::string word; words >> word;) numbers.push_back(word == "-" ? -1 : std::stoi(word));
  return numbers;
}

template <typename Values>
Numbers numbersOf(const Values& values) {
  return Numbers(values.begin(), values.end());
}

TEST(FrameFormat, MeshHasTheOrderOfThePage) {
  ClothLayout cloth;
  std::vector<std::vector<Numbers>> rows;
  std::ifstream page("proto/FRAME_FORMAT.md");
  std::string line;
  while (std::getline(page, line) && line != "### A mesh") {
  }
  while (std::getline(page, line) && !line.starts_with("## ")) {
    if (line.starts_with("    "))
      for (const int vertex : numbersOf(line)) cloth.triangles.push_back(static_cast<std::uint32_t>(vertex));
    const Cells cells = cellsOf(line);
    int vertex = 0;
    if (cells.size() != 7 || !isNumber(cells[0], vertex)) continue;
    rows.emplace_back();
    for (const std::string& cell : cells) rows.back().push_back(numbersOf(cell));
    for (const int coordinate : rows.back()[1]) cloth.restPositions.push_back(static_cast<float>(coordinate));
  }
  ASSERT_EQ(rows.size(), 20u);
  cloth.vertexCount = 20;
  const CodingOrder order = orderMesh(cloth);
  for (std::size_t v = 0; v < rows.size(); ++v) {
    EXPECT_EQ(rows[v][2], Numbers{static_cast<int>(order.ranks[v])}) << v;
    EXPECT_EQ(rows[v][3], numbersOf(order.neighbours[v].parents)) << v;
    EXPECT_EQ(rows[v][4], numbersOf(order.neighbours[v].weights)) << v;
    EXPECT_EQ(rows[v][5], numbersOf(order.neighbours[v].ring)) << v;
    EXPECT_EQ(rows[v][6], numbersOf(order.nearest[v])) << v;
  }
}

}  // namespace
}  // namespace clothstream::codec::hierarchical
