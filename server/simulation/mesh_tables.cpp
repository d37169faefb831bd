// SPDX-License-Identifier: MIT
// Springs and triangles by the nodes at which they meet.
#include "server/simulation/mesh_tables.h"

#include "server/model/mesh.h"

namespace clothstream::simulation {
namespace {

void appendTiles(std::uint32_t cloth, std::uint32_t nodes, std::size_t nodesBefore,
                 std::uint32_t workgroupSize, std::vector<shared::MeshTileRecord>& tiles) {
  for (std::uint32_t first = 0; first < nodes; first += workgroupSize)
    tiles.push_back(
        {static_cast<float>(cloth), static_cast<float>(first), static_cast<float>(nodesBefore + first), 0});
}

void appendSprings(const model::Mesh& mesh, std::uint32_t firstNode, std::span<shared::MeshNodeRecord> nodes,
                   std::vector<shared::SpringPairRecord>& pairs) {
  const model::SpringAdjacency adjacency = model::springAdjacency(mesh.links, mesh.nodeCount());
  const auto numberOf = [&](std::uint32_t node) { return static_cast<float>(firstNode + node + 1); };
  for (std::uint32_t node = 0; node < mesh.nodeCount(); ++node) {
    const std::size_t first = pairs.size();
    bool full = true;
    for (const std::uint32_t spring : adjacency.of(node)) {
      const model::SpringLink& link = mesh.links[spring];
      const float other = numberOf(link.a == node ? link.b : link.a);
      const float signedOther = link.kind == model::SpringKind::shear ? -other : other;
      const float signedLength = link.kind == model::SpringKind::bend ? -link.restLength : link.restLength;
      if (full)
        pairs.push_back({{{signedOther, signedLength}, {numberOf(node), 1}}});
      else
        pairs.back().springs[1] = {signedOther, signedLength};
      full = !full;
    }
    nodes[node].springs = shared::listRecord(first, pairs.size());
  }
}

}  // namespace

void appendCorners(const model::Mesh& mesh, std::uint32_t firstNode, std::span<shared::MeshNodeRecord> nodes,
                   std::vector<shared::CornerPairRecord>& pairs) {
  std::vector<std::uint32_t> counts(mesh.nodeCount(), 0);
  for (const model::Triangle& triangle : mesh.shape.triangles)
    for (const std::uint32_t node : triangle) ++counts[node];
  for (std::uint32_t node = 0; node < mesh.nodeCount(); ++node) {
    const std::uint32_t texels = (counts[node] + 1) / 2;
    const auto self = static_cast<float>(firstNode + node);
    nodes[node].triangles = shared::listRecord(pairs.size(), pairs.size() + texels);
    pairs.resize(pairs.size() + texels, {{{self, self}, {self, self}}});
    counts[node] = 0;  // now the number of written triangles
  }
  for (const model::Triangle& triangle : mesh.shape.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t node = triangle[i], written = counts[node]++;
      const shared::ListRecord& list = nodes[node].triangles;
      const std::size_t start = shared::wholeNumber(list.firstLow, list.firstHigh);
      const auto second = static_cast<float>(firstNode + triangle[(i + 1) % 3]);
      const auto third = static_cast<float>(firstNode + triangle[(i + 2) % 3]);
      pairs[start + written / 2].triangles[written % 2] = {second, third};
    }
}

MeshTiles meshTiles(std::span<const model::Cloth> cloths, std::uint32_t workgroupSize) {
  MeshTiles tiles;
  for (const Follow follow : kFollows) {
    std::size_t nodes = 0;
    for (std::uint32_t i = 0; i < cloths.size(); ++i) {
      if (!cloths[i].mesh) continue;
      if (followOf(cloths[i]) == follow)
        appendTiles(i, cloths[i].nodeCount(), nodes, workgroupSize, tiles.records);
      nodes += cloths[i].nodeCount();
    }
    tiles.ranges.ends[static_cast<std::size_t>(follow)] = static_cast<std::uint32_t>(tiles.records.size());
  }
  return tiles;
}

MeshTables meshTables(std::span<const model::Cloth> cloths, std::uint32_t workgroupSize) {
  MeshTables tables;
  tables.tiles = meshTiles(cloths, workgroupSize);

  std::uint32_t firstNode = 0;
  for (std::uint32_t i = 0; i < cloths.size(); firstNode += cloths[i++].nodeCount()) {
    if (!cloths[i].mesh) continue;
    const model::Mesh& mesh = *cloths[i].mesh;
    const std::size_t before = tables.nodes.size();
    tables.nodes.resize(before + mesh.nodeCount());
    const std::span<shared::MeshNodeRecord> nodes = std::span(tables.nodes).subspan(before);
    appendSprings(mesh, firstNode, nodes, tables.springEnds);
    appendCorners(mesh, firstNode, nodes, tables.corners);
  }
  return tables;
}

}  // namespace clothstream::simulation
