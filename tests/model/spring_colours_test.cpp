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
  const auto blockOf = [&](std::uint32_t node, std::uint32_t shift) {
    const std::uint32_t row = node / 15 + shift, column = node % 15 + shift;
    return std::pair(row / kBlock, column / kBlock);
  };
  for (std::size_t colour = kCornerColours; colour < colours.count(); ++colour) {
    const std::uint32_t shift = colour < kCornerColours + kSeamColours ? kBlock / 2 : 0;
    for (const SpringLink& link : colours.of(colour))
      EXPECT_EQ(blockOf(link.a, shift), blockOf(link.b, shift)) << link.a << " " << link.b;
  }
  // Quads of the corner pass share no node, so a node has at most two springs.
  std::vector<int> springs(cloth.nodeCount(), 0);
  for (std::size_t colour = 0; colour < kCornerColours; ++colour)
    for (const SpringLink& link : colours.of(colour))
      for (const std::uint32_t node : {link.a, link.b}) ++springs[node];
  EXPECT_EQ(std::ranges::max(springs), 1);
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
