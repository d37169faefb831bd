// SPDX-License-Identifier: MIT
// Tables of the hinges of a scene.
#include "server/simulation/bending/bending_tables.h"

#include <cmath>

#include "server/model/hinges.h"

namespace clothstream::simulation {
namespace {

void addLists(const std::vector<std::vector<std::uint32_t>>& numbers, BendingTables& tables) {
  for (const std::vector<std::uint32_t>& ofNode : numbers) {
    const std::size_t first = tables.lists.size();
    for (std::size_t i = 0; i < ofNode.size(); i += 4) {
      const auto at = [&](std::size_t k) { return k < ofNode.size() ? static_cast<float>(ofNode[k]) : 0.0f; };
      tables.lists.push_back({{at(i), at(i + 1), at(i + 2), at(i + 3)}});
    }
    tables.incidences.push_back(shared::listRecord(first, tables.lists.size()));
  }
}

}  // namespace

BendingTables bendingTables(std::span<const model::Cloth> cloths) {
  BendingTables tables;
  std::uint32_t firstNode = 0;
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    const model::Cloth& cloth = cloths[i];
    std::vector<std::vector<std::uint32_t>> numbers(cloth.nodeCount());
    for (const model::Hinge& hinge :
         cloth.dihedralBending > 0 ? model::hinges(cloth) : std::vector<model::Hinge>()) {
      const auto slot = static_cast<std::uint32_t>(4 * tables.hinges.size());
      const auto node = [&](std::size_t place) { return static_cast<float>(firstNode + hinge.nodes[place]); };
      tables.hinges.push_back({.edgeStart = node(0),
                               .edgeEnd = node(1),
                               .firstOpposite = node(2),
                               .secondOpposite = node(3),
                               .weight = hinge.weight,
                               .restQuarter = static_cast<float>(std::tan(double{hinge.restAngle} / 4)),
                               .leastSquare = hinge.leastSquare,
                               .cloth = static_cast<float>(i)});
      for (std::uint32_t place = 0; place < 4; ++place)
        numbers[hinge.nodes[place]].push_back(slot + place + 1);
    }
    addLists(numbers, tables);
    firstNode += cloth.nodeCount();
  }
  return tables;
}

}  // namespace clothstream::simulation
