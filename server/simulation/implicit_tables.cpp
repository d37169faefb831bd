// SPDX-License-Identifier: MIT
// The springs of implicit cloths as the kernels read them.
#include "server/simulation/implicit_tables.h"

#include <cstdint>

#include "server/scene/springs.h"
#include "server/simulation/halves.h"

namespace clothstream::simulation {
namespace {

std::vector<scene::SpringLink> springsOf(const scene::Cloth& cloth) {
  std::vector<scene::SpringLink> links = scene::springLinks(cloth);
  const std::vector<std::uint8_t> pinned = scene::pinnedNodes(cloth);
  std::erase_if(links,
                [&](const scene::SpringLink& link) { return pinned[link.a] != 0 && pinned[link.b] != 0; });
  return links;
}

// The springs that meet at a node of the cloth, two a record.
void appendList(std::span<const std::uint32_t> springs, std::span<const scene::SpringLink> links,
                std::uint32_t node, std::uint32_t firstNode, std::vector<shared::SpringEndsRecord>& lists) {
  const auto self = static_cast<float>(firstNode + node);
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const scene::SpringLink& link = links[springs[i]];
    const bool isFirstEnd = link.a == node;
    const float number = static_cast<float>(springs[i] + 1) * (isFirstEnd ? 1.0f : -1.0f);
    const auto other = static_cast<float>(firstNode + (isFirstEnd ? link.b : link.a));
    if (i % 2 == 0)
      lists.push_back({{number, other, 0, self}});
    else
      lists.back().two.z = number, lists.back().two.w = other;
  }
}

void appendSystem(const scene::Cloth& cloth, std::size_t number, std::uint32_t firstNode,
                  ImplicitTables& tables) {
  const std::vector<scene::SpringLink> links = springsOf(cloth);
  if (links.empty()) return;
  const std::uint32_t nodes = cloth.nodeCount();
  tables.systems.push_back(
      {.links = halves(tables.springs.size(), static_cast<float>(links.size()), static_cast<float>(number)),
       .nodes = {static_cast<float>(firstNode), static_cast<float>(nodes), 0, 0}});
  for (const scene::SpringLink& link : links)
    tables.springs.push_back(
        {{static_cast<float>(firstNode + link.a), static_cast<float>(firstNode + link.b), link.restLength,
          static_cast<float>(CLOTHSTREAM_SPRING_KINDS * number + static_cast<std::size_t>(link.kind))}});
  const scene::SpringAdjacency adjacency = scene::springAdjacency(links, nodes);
  for (std::uint32_t node = 0; node < nodes; ++node) {
    const std::size_t first = tables.lists.size();
    appendList(adjacency.of(node), links, node, firstNode, tables.lists);
    tables.incidences[firstNode + node] = {halves(first, static_cast<float>(tables.lists.size() - first),
                                                  static_cast<float>(tables.systems.size()))};
  }
}

}  // namespace

ImplicitTables implicitTables(std::span<const scene::Cloth> cloths) {
  ImplicitTables tables;
  std::uint32_t nodes = 0;
  for (const scene::Cloth& cloth : cloths) nodes += cloth.nodeCount();
  tables.incidences.resize(nodes, {{0, 0, 0, 0}});
  std::uint32_t firstNode = 0;
  for (std::size_t i = 0; i < cloths.size(); firstNode += cloths[i++].nodeCount())
    if (cloths[i].solver.kind == scene::SolverKind::implicitEuler)
      appendSystem(cloths[i], i, firstNode, tables);
  return tables;
}

}  // namespace clothstream::simulation
