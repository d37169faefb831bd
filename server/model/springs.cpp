// SPDX-License-Identifier: MIT
// Springs of grids, solver coefficients and adjacency.
#include "server/model/springs.h"

#include <algorithm>
#include <limits>

#include "server/model/mesh.h"

namespace clothstream::model {

std::vector<SpringLink> springLinks(const Cloth& cloth) {
  if (cloth.mesh) return cloth.mesh->links;
  const std::uint32_t rows = cloth.grid.rows, columns = cloth.grid.columns;
  const GridSpacing lengths = spacing(cloth.grid);
  std::vector<SpringLink> links;
  links.reserve(std::size_t{6} * rows * columns);
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t a = row * columns + column;
      const bool right = column + 1 < columns, down = row + 1 < rows;
      if (right) links.push_back({a, a + 1, SpringKind::structural, lengths.column});
      if (down) links.push_back({a, a + columns, SpringKind::structural, lengths.row});
      if (down && column > 0) links.push_back({a, a + columns - 1, SpringKind::shear, lengths.diagonal});
      if (down && right) links.push_back({a, a + columns + 1, SpringKind::shear, lengths.diagonal});
      if (column + 2 < columns) links.push_back({a, a + 2, SpringKind::bend, 2 * lengths.column});
      if (row + 2 < rows) links.push_back({a, a + 2 * columns, SpringKind::bend, 2 * lengths.row});
    }
  return links;
}

std::uint64_t springCount(const Cloth& cloth) {
  if (cloth.mesh) return cloth.mesh->links.size();
  const std::uint64_t rows = cloth.grid.rows, columns = cloth.grid.columns;
  const std::uint64_t structural = rows * (columns - 1) + columns * (rows - 1);
  const std::uint64_t shear = 2 * (rows - 1) * (columns - 1);
  const std::uint64_t bend = rows * (columns - std::min<std::uint64_t>(columns, 2)) +
                             columns * (rows - std::min<std::uint64_t>(rows, 2));
  return structural + shear + bend;
}

float shortestSpring(const Cloth& cloth) {
  if (!cloth.mesh) return std::min(spacing(cloth.grid).column, spacing(cloth.grid).row);
  float shortest = std::numeric_limits<float>::infinity();
  for (const SpringLink& link : cloth.mesh->links)
    if (link.kind == SpringKind::structural) shortest = std::min(shortest, link.restLength);
  return shortest;
}

const Spring& springOf(const Cloth& cloth, SpringKind kind) {
  return kind == SpringKind::structural ? cloth.structural
         : kind == SpringKind::shear    ? cloth.shear
                                        : cloth.bend;
}

bool isConstraint(const Solver& solver, SpringKind kind) {
  if (solver.kind == SolverKind::xpbd) return true;
  return (solver.kind == SolverKind::constraint || solver.kind == SolverKind::acad) &&
         (kind != SpringKind::bend || solver.bendConstraints);
}

std::vector<SpringLink> systemLinks(const Cloth& cloth) {
  std::vector<SpringLink> links = springLinks(cloth);
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  const bool all = cloth.solver.kind == SolverKind::implicitEuler;
  std::erase_if(links, [&](const SpringLink& link) {
    return (pinned[link.a] != 0 && pinned[link.b] != 0) || (!all && !isConstraint(cloth.solver, link.kind));
  });
  return links;
}

std::uint64_t systemEntries(const Cloth& cloth) {
  const std::vector<SpringLink> links = systemLinks(cloth);
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  std::vector<std::uint64_t> meeting(cloth.nodeCount(), 0);
  for (const SpringLink& link : links)
    for (const std::uint32_t node : {link.a, link.b}) ++meeting[node];
  std::uint64_t entries = links.size();
  for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node)
    if (pinned[node] == 0 && meeting[node] > 0) entries += meeting[node] * (meeting[node] - 1);
  return entries;
}

Spring forceOf(const Cloth& cloth, SpringKind kind) {
  if (cloth.solver.kind == SolverKind::xpbd) return {};
  Spring spring = springOf(cloth, kind);
  if (cloth.solver.kind == SolverKind::constraint && isConstraint(cloth.solver, kind)) spring.stiffness = 0;
  return spring;
}

double scaledCompliance(const Cloth& cloth, double h) {
  if (cloth.solver.compliance) return *cloth.solver.compliance / (h * h);
  if (isAcad(cloth.solver, AcadMode::paper)) return 0;
  const float relative = isAcad(cloth.solver, AcadMode::limit) ? kLimitCompliance : kRelativeCompliance;
  return double{relative} / cloth.nodeMass();
}

XpbdSpring xpbdSpring(const Cloth& cloth, SpringKind kind, double h) {
  const Spring& spring = springOf(cloth, kind);
  const bool overridden = cloth.solver.compliance && kind != SpringKind::bend;
  if (!overridden && spring.stiffness == 0) return {};
  const double compliance = overridden ? double{*cloth.solver.compliance} : 1 / double{spring.stiffness};
  const double memory = compliance / (h * h), damping = compliance * spring.damping / h;
  const double scale = 1 / std::max(1.0, memory);
  return {scale, damping * scale, memory * scale};
}

SpringAdjacency springAdjacency(std::span<const SpringLink> links, std::uint32_t nodeCount) {
  SpringAdjacency adjacency{std::vector<std::uint32_t>(nodeCount + 1, 0),
                            std::vector<std::uint32_t>(2 * links.size())};
  for (const SpringLink& link : links)
    for (const std::uint32_t node : {link.a, link.b}) ++adjacency.first[node + 1];
  for (std::uint32_t node = 0; node < nodeCount; ++node) adjacency.first[node + 1] += adjacency.first[node];
  std::vector<std::uint32_t> next(adjacency.first.begin(), adjacency.first.end() - 1);
  for (std::uint32_t i = 0; i < links.size(); ++i)
    for (const std::uint32_t node : {links[i].a, links[i].b}) adjacency.springs[next[node]++] = i;
  return adjacency;
}

}  // namespace clothstream::model
