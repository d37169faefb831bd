// SPDX-License-Identifier: MIT
// Colours of springs: each spring has one colour, and no two springs of a colour share a node.
#include "server/model/spring_colours.h"

#include <algorithm>
#include <memory>
#include <tuple>

#include <gtest/gtest.h>

#include "server/model/mesh.h"
#include "tests/model/meshes.h"

namespace clothstream::model {
namespace {

Cloth discCloth(std::uint32_t rings) {
  Cloth cloth;
  cloth.mesh = std::make_shared<const Mesh>(makeMesh(model::disc(rings, 0.1f)));
  return cloth;
}

using Key = std::tuple<std::uint32_t, std::uint32_t, SpringKind, float>;

std::vector<Key> keysOf(std::vector<SpringLink> links) {
  std::vector<Key> keys;
  for (const SpringLink& link : links) keys.emplace_back(link.a, link.b, link.kind, link.restLength);
  return keys;
}

std::vector<Cloth> cloths() {
  std::vector<Cloth> all{discCloth(1), discCloth(9)};
  for (const auto& [rows, columns] :
       {std::pair{2u, 2u}, {2u, 9u}, {9u, 2u}, {3u, 3u}, {4u, 4u}, {5u, 6u}, {7u, 8u}, {17u, 23u}})
    all.push_back(grid(rows, columns));
  return all;
}

TEST(SpringColours, ContainEverySpringOnce) {
  for (const Cloth& cloth : cloths()) {
    std::vector<Key> coloured = keysOf(springColours(cloth).links), listed = keysOf(springLinks(cloth));
    std::ranges::sort(coloured);
    std::ranges::sort(listed);
    EXPECT_EQ(coloured, listed) << cloth.grid.rows << " x " << cloth.grid.columns;
  }
}

TEST(SpringColours, ContainAtMostOneSpringPerNode) {
  for (const Cloth& cloth : cloths()) {
    const SpringColours colours = springColours(cloth);
    ASSERT_EQ(colours.ends.back(), colours.links.size());
    for (std::size_t colour = 0; colour < colours.count(); ++colour) {
      std::vector<int> springs(cloth.nodeCount(), 0);
      for (const SpringLink& link : colours.of(colour))
        for (const std::uint32_t node : {link.a, link.b})
          ASSERT_EQ(++springs[node], 1) << cloth.grid.rows << " x " << cloth.grid.columns << ", " << colour;
    }
  }
}

// A kernel can process a whole block: within a pass, springs that share a node belong to one block.
TEST(SpringColours, MeetOnlyInsideABlockInEachPass) {
  const Cloth cloth = grid(18, 15);
  const SpringColours colours = springColours(cloth);
  ASSERT_EQ(colours.count(), kCornerColours + kSeamColours + kInsideColours);
  const auto blockOf = [&](std::uint32_t node, bool seams) {
    const auto row = static_cast<std::int32_t>(node / 15), column = static_cast<std::int32_t>(node % 15);
    return std::pair((row - blockLine(18, seams).first) / kBlock,
                     (column - blockLine(15, seams).first) / kBlock);
  };
  for (std::size_t colour = kCornerColours; colour < colours.count(); ++colour) {
    const bool seams = colour < kCornerColours + kSeamColours;
    for (const SpringLink& link : colours.of(colour))
      EXPECT_EQ(blockOf(link.a, seams), blockOf(link.b, seams)) << link.a << " " << link.b;
  }
  // Quads of the corner pass share no node, so a node has at most two springs.
  std::vector<int> springs(cloth.nodeCount(), 0);
  for (std::size_t colour = 0; colour < kCornerColours; ++colour)
    for (const SpringLink& link : colours.of(colour))
      for (const std::uint32_t node : {link.a, link.b}) ++springs[node];
  EXPECT_EQ(std::ranges::max(springs), 1);
}

// The order of a sweep over a grid with even numbers of rows and columns is its own mirror image: each colour
// has the mirror image of a colour with no spring between both that shares a node with either.
TEST(SpringColours, KeepTheSymmetryOfEvenGrids) {
  for (const auto& [rows, columns] : {std::pair{2u, 4u}, {8u, 12u}, {10u, 14u}, {18u, 6u}}) {
    SCOPED_TRACE(testing::Message() << rows << " x " << columns);
    const SpringColours colours = springColours(grid(rows, columns));
    const auto mirrored = [&](std::uint32_t node, bool upright) {
      const std::uint32_t row = node / columns, column = node % columns;
      return upright ? (rows - 1 - row) * columns + column : row * columns + columns - 1 - column;
    };
    for (const bool upright : {false, true}) {
      // Nodes keep their values if the sweep of the mirror image visits them with the same neighbours in the
      // same order.
      const auto visits = [&](bool mirror) {
        std::vector<std::vector<std::uint32_t>> neighbours(std::size_t{rows} * columns);
        for (const SpringLink& link : colours.links) {
          const std::uint32_t a = mirror ? mirrored(link.a, upright) : link.a,
                              b = mirror ? mirrored(link.b, upright) : link.b;
          neighbours[a].push_back(b);
          neighbours[b].push_back(a);
        }
        return neighbours;
      };
      EXPECT_EQ(visits(true), visits(false)) << (upright ? "upright" : "sideways");
    }
  }
}

TEST(SpringColours, AreFewAndDeterministicForMeshes) {
  const Cloth cloth = discCloth(12);
  const SpringColours colours = springColours(cloth), again = springColours(cloth);
  EXPECT_EQ(keysOf(colours.links), keysOf(again.links));
  EXPECT_EQ(colours.ends, again.ends);
  const SpringAdjacency adjacency = springAdjacency(cloth.mesh->links, cloth.nodeCount());
  std::size_t most = 0;
  for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node)
    most = std::max(most, adjacency.of(node).size());
  EXPECT_GE(colours.count(), most);
  EXPECT_LT(colours.count(), 2 * most);
}

}  // namespace
}  // namespace clothstream::model
