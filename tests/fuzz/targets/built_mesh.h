// SPDX-License-Identifier: MIT
// Checks of the mesh that is built from a file.
#pragma once

#include "server/meshes/mesh_source.h"
#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

inline const meshes::MeshLimits kFuzzedMeshLimits{
    .maxVertices = 16'384, .maxCoordinate = 1000, .minEdge = 1e-4f, .maxNodeSprings = 1024};

// Promise: triangles of a built mesh name existing nodes, and vertices lead to all nodes.
inline void checkNodes(const meshes::BuiltMesh& built) {
  const std::size_t nodes = built.mesh.shape.positions.size();
  for (const auto& triangle : built.mesh.shape.triangles)
    for (const std::uint32_t node : triangle) require(node < nodes, "triangles name existing nodes");
  std::vector<bool> isReached(nodes, false);
  for (std::uint32_t node : built.nodeOfVertex)
    for (; node != meshes::kNoNode; node = built.nextCopy.empty() ? meshes::kNoNode : built.nextCopy[node]) {
      require(node < nodes, "vertices name existing nodes");
      if (isReached[node]) break;
      isReached[node] = true;
    }
  for (const bool reached : isReached) require(reached, "each node has a vertex");
}

// Promise: a repaired mesh needs no repair.
inline void checkRepaired(const meshes::BuiltMesh& built) {
  meshes::MeshSource source;
  source.vertices = built.mesh.shape.positions;
  source.halves.assign(built.mesh.shape.quads.begin(), built.mesh.shape.quads.end());
  for (const auto& [a, b, c] : built.mesh.shape.triangles)
    source.faces.push_back({.cornerCount = 3, .vertices = {a, b, c}, .uvs = {}});
  const auto again = meshes::buildMesh(source, {}, kFuzzedMeshLimits);
  require(again.has_value(), "a repaired mesh is accepted without a repair");
  require(again->mesh.shape.positions == built.mesh.shape.positions, "a repaired mesh keeps its order");
}

// Builds the mesh without and with repairs.
inline void buildAndCheck(const meshes::MeshSource& source) {
  const auto plain = meshes::buildMesh(source, {.weldDistance = 1e-3f}, kFuzzedMeshLimits);
  if (plain) checkNodes(*plain);
  if (!plain) require(!plain.error().text.empty(), "an error has a text");
  const auto repaired =
      meshes::buildMesh(source, {.weldDistance = 1e-3f, .repair = true, .fit = true}, kFuzzedMeshLimits);
  if (!repaired) {
    require(!repaired.error().text.empty(), "an error has a text");
    require(repaired.error().text.find("set \"repair\"") == std::string::npos,
            "a repair does not ask for a repair");
    return;
  }
  checkNodes(*repaired);
  checkRepaired(*repaired);
}

}  // namespace clothstream::fuzz
