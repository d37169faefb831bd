// SPDX-License-Identifier: MIT
// The constraints of a scene as the kernels read them.
#include "server/simulation/constraint_tables.h"

#include <algorithm>
#include <cstdint>

#include "server/scene/springs.h"
#include "server/simulation/halves.h"

namespace clothstream::simulation {
namespace {

std::vector<scene::SpringLink> constraintsOf(const scene::Cloth& cloth) {
  std::vector<scene::SpringLink> links = scene::springLinks(cloth);
  const std::vector<std::uint8_t> pinned = scene::pinnedNodes(cloth);
  std::erase_if(links, [&](const scene::SpringLink& link) {
    return !scene::isConstraint(cloth.solver, link.kind) || (pinned[link.a] != 0 && pinned[link.b] != 0);
  });
  return links;
}

// Numbers of a node's constraints, signed, four a texel.
void appendList(std::span<const std::uint32_t> springs, std::span<const scene::SpringLink> links,
                std::uint32_t node, std::vector<shared::vec4>& lists) {
  for (std::size_t first = 0; first < springs.size(); first += 4) {
    float four[4] = {};
    for (std::size_t k = 0; k < std::min<std::size_t>(4, springs.size() - first); ++k) {
      const std::uint32_t spring = springs[first + k];
      four[k] = static_cast<float>(spring + 1) * (links[spring].a == node ? -1.0f : 1.0f);
    }
    lists.push_back({four[0], four[1], four[2], four[3]});
  }
}

void appendSystem(const scene::Cloth& cloth, std::size_t number, std::uint32_t firstNode,
                  ConstraintTables& tables) {
  const std::vector<scene::SpringLink> links = constraintsOf(cloth);
  if (links.empty()) return;
  const std::uint32_t nodes = cloth.nodeCount();
  tables.systems.push_back(
      {.links = halves(tables.links.size(), static_cast<float>(links.size()), static_cast<float>(number)),
       .nodes = {static_cast<float>(firstNode), static_cast<float>(nodes), 0, 0}});
  for (const scene::SpringLink& link : links)
    tables.links.push_back({{static_cast<float>(firstNode + link.a), static_cast<float>(firstNode + link.b),
                             link.restLength, static_cast<float>(number)}});
  const scene::SpringAdjacency adjacency = scene::springAdjacency(links, nodes);
  for (std::uint32_t node = 0; node < nodes; ++node) {
    const std::size_t first = tables.lists.size();
    appendList(adjacency.of(node), links, node, tables.lists);
    tables.incidences[firstNode + node] = {halves(first, static_cast<float>(tables.lists.size() - first),
                                                  static_cast<float>(tables.systems.size()))};
  }
}

}  // namespace

ConstraintTables constraintTables(std::span<const scene::Cloth> cloths) {
  ConstraintTables tables;
  std::uint32_t nodes = 0;
  for (const scene::Cloth& cloth : cloths) nodes += cloth.nodeCount();
  tables.incidences.resize(nodes, {{0, 0, 0, 0}});
  const auto append = [&](scene::SolverKind kind) {
    std::uint32_t firstNode = 0;
    for (std::size_t i = 0; i < cloths.size(); firstNode += cloths[i++].nodeCount())
      if (cloths[i].solver.kind == kind) appendSystem(cloths[i], i, firstNode, tables);
  };
  append(scene::SolverKind::constraint);
  tables.always = static_cast<std::uint32_t>(tables.systems.size());
  append(scene::SolverKind::acad);
  return tables;
}

}  // namespace clothstream::simulation
