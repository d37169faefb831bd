// SPDX-License-Identifier: MIT
// Checks of the mesh that is built from a file.
#pragma once

#include "server/meshes/mesh_source.h"
#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

// Builds the mesh. Promise: triangles of a built mesh name existing nodes.
inline void buildAndCheck(const meshes::MeshSource& source) {
  const auto built = meshes::buildMesh(
      source, {.weldDistance = 1e-3f},
      {.maxVertices = 16'384, .maxCoordinate = 1000, .minEdge = 1e-4f, .maxNodeSprings = 1024});
  if (!built) return require(!built.error().empty(), "an error has a text");
  const std::size_t nodes = built->mesh.shape.positions.size();
  for (const auto& triangle : built->mesh.shape.triangles)
    for (const std::uint32_t node : triangle) require(node < nodes, "triangles name existing nodes");
  for (const std::uint32_t node : built->nodeOfVertex)
    require(node == meshes::kNoNode || node < nodes, "vertices name existing nodes");
}

}  // namespace clothstream::fuzz
