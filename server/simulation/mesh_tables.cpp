// SPDX-License-Identifier: MIT
// Springs and triangles by the nodes at which they meet.
#include "server/simulation/mesh_tables.h"

#include "server/scene/mesh.h"

namespace clothstream::simulation {
namespace {

void appendTiles(std::uint32_t cloth, std::uint32_t nodes, std::size_t nodesBefore,
                 std::uint32_t workgroupSize, std::vector<shared::TileRecord>& tiles) {
  for (std::uint32_t first = 0; first < nodes; first += workgroupSize)
    tiles.push_back(
        {{static_cast<float>(cloth), static_cast<float>(first), static_cast<float>(nodesBefore + first), 0}});
}

void appendSprings(const scene::Mesh& mesh, std::uint32_t firstNode, std::span<shared::MeshNodeRecord> nodes,
                   std::vector<shared::SpringEndRecord>& ends) {
  const scene::SpringAdjacency adjacency = scene::springAdjacency(mesh.links, mesh.nodeCount());
  for (std::uint32_t node = 0; node < mesh.nodeCount(); ++node) {
    nodes[node].firstSpring = static_cast<std::uint32_t>(ends.size());
    nodes[node].springCount = static_cast<std::uint32_t>(adjacency.of(node).size());
    for (const std::uint32_t spring : adjacency.of(node)) {
      const scene::SpringLink& link = mesh.links[spring];
      const std::uint32_t other = firstNode + (link.a == node ? link.b : link.a);
      ends.push_back({shared::packOther(other, static_cast<std::uint32_t>(link.kind)), link.restLength});
    }
  }
}

// In the order of the triangles.
void appendCorners(const scene::Mesh& mesh, std::uint32_t firstNode, std::span<shared::MeshNodeRecord> nodes,
                   std::vector<shared::TriangleCornerRecord>& corners) {
  for (const scene::Triangle& triangle : mesh.shape.triangles)
    for (const std::uint32_t node : triangle) ++nodes[node].triangleCount;
  std::size_t next = corners.size();
  for (shared::MeshNodeRecord& node : nodes) {
    node.firstTriangle = static_cast<std::uint32_t>(next);
    next += node.triangleCount;
    node.triangleCount = 0;
  }
  corners.resize(next);
  for (const scene::Triangle& triangle : mesh.shape.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      shared::MeshNodeRecord& node = nodes[triangle[i]];
      corners[node.firstTriangle + node.triangleCount++] = {firstNode + triangle[(i + 1) % 3],
                                                            firstNode + triangle[(i + 2) % 3]};
    }
}

}  // namespace

MeshTables meshTables(std::span<const scene::Cloth> cloths, std::uint32_t workgroupSize) {
  MeshTables tables;
  const auto append = [&](bool constrained) {
    std::size_t nodes = 0;
    for (std::uint32_t i = 0; i < cloths.size(); ++i) {
      if (!cloths[i].mesh) continue;
      if (constrained == (cloths[i].solver.kind != scene::SolverKind::massSpring))
        appendTiles(i, cloths[i].nodeCount(), nodes, workgroupSize, tables.tiles.records);
      nodes += cloths[i].nodeCount();
    }
  };
  append(false);
  tables.tiles.withoutConstraints = static_cast<std::uint32_t>(tables.tiles.records.size());
  append(true);

  std::uint32_t firstNode = 0;
  for (std::uint32_t i = 0; i < cloths.size(); firstNode += cloths[i++].nodeCount()) {
    if (!cloths[i].mesh) continue;
    const scene::Mesh& mesh = *cloths[i].mesh;
    const std::size_t before = tables.nodes.size();
    tables.nodes.resize(before + mesh.nodeCount(), {0, 0, 0, 0});
    const std::span<shared::MeshNodeRecord> nodes = std::span(tables.nodes).subspan(before);
    appendSprings(mesh, firstNode, nodes, tables.springEnds);
    appendCorners(mesh, firstNode, nodes, tables.corners);
  }
  return tables;
}

}  // namespace clothstream::simulation
