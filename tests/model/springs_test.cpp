// SPDX-License-Identifier: MIT
// List of springs, and the springs at each node.
#include "server/model/springs.h"

#include <algorithm>
#include <tuple>

#include <gtest/gtest.h>

#include "tests/model/meshes.h"

namespace clothstream::model {
namespace {

std::size_t countOf(const std::vector<SpringLink>& links, SpringKind kind) {
  return static_cast<std::size_t>(std::ranges::count(links, kind, &SpringLink::kind));
}

// Numbers of springs from [Va21] Fig. 9 and 10.
TEST(SpringLinks, HaveTheNumbersOfThePaper) {
  EXPECT_EQ(springLinks(grid(34, 34)).size(), 6'598u);
  EXPECT_EQ(springLinks(grid(32, 32)).size(), 5'826u);
  const auto withoutBend = [](std::uint32_t size) {
    const std::vector<SpringLink> links = springLinks(grid(size, size));
    return links.size() - countOf(links, SpringKind::bend);
  };
  EXPECT_EQ(withoutBend(32), 3'906u);
  EXPECT_EQ(withoutBend(38), 5'550u);
}

TEST(SpringLinks, HaveTheDistanceOfTheirEndsAsRestLength) {
  const Cloth cloth = grid(5, 4);
  const std::vector<Vec3> rest = restPositions(cloth.grid);
  for (const SpringLink& link : springLinks(cloth))
    EXPECT_NEAR((rest[link.b] - rest[link.a]).norm(), link.restLength, 1e-6f) << link.a << " " << link.b;
}

TEST(SpringLinks, AreOrderedAndUnique) {
  const std::vector<SpringLink> links = springLinks(grid(4, 6));
  for (std::size_t i = 0; i < links.size(); ++i) {
    EXPECT_LT(links[i].a, links[i].b);
    if (i == 0) continue;
    const auto key = [](const SpringLink& link) { return std::tuple(link.a, link.kind, link.b); };
    EXPECT_LT(key(links[i - 1]), key(links[i]));
  }
}

// A row has 1 + (d_a - 1) + (d_b - 1) entries for d springs at a node that can move.
TEST(SystemEntries, CountNodesThatCanMove) {
  Cloth cloth = grid(7, 6);
  cloth.solver.kind = SolverKind::constraint;
  cloth.solver.bendConstraints = true;
  cloth.pins = {{.firstRow = 0, .lastRow = 1, .firstColumn = 0, .lastColumn = 5}};
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  const std::vector<SpringLink> links = systemLinks(cloth);
  EXPECT_EQ(links.size(), springLinks(cloth).size() - (2 * 5 + 6 + 2 * 5 + 2 * 4));
  std::uint64_t entries = 0;
  for (const SpringLink& row : links)
    for (const SpringLink& column : links)
      for (const std::uint32_t node : {row.a, row.b})
        if (pinned[node] == 0 && (node == column.a || node == column.b)) ++entries;
  for (const SpringLink& row : links) entries -= pinned[row.a] == 0 && pinned[row.b] == 0 ? 1 : 0;
  EXPECT_EQ(systemEntries(cloth), entries);
}

TEST(SpringAdjacency, ListsEachSpringAtBothNodesInOrder) {
  const std::vector<SpringLink> links = springLinks(grid(5, 5));
  const SpringAdjacency adjacency = springAdjacency(links, 25);
  ASSERT_EQ(adjacency.springs.size(), 2 * links.size());
  for (std::uint32_t node = 0; node < 25; ++node) {
    EXPECT_TRUE(std::ranges::is_sorted(adjacency.of(node)));
    for (const std::uint32_t spring : adjacency.of(node))
      EXPECT_TRUE(links[spring].a == node || links[spring].b == node);
  }
  EXPECT_EQ(adjacency.of(12).size(), 12u);  // the middle has all twelve
}

}  // namespace
}  // namespace clothstream::model
