// SPDX-License-Identifier: MIT
// Repairs meshes that were not made for simulation.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// Triangles that fulfil the requirements of MeshShape, with the vertices of the source and copies of some.
struct RepairedMesh {
  MeshSource source;                  // triangles only; `halves` are the quads that are left
  std::vector<model::Vec3> placed;    // positions of the vertices of `source`
  std::vector<std::uint32_t> origin;  // for each vertex of `source`, the vertex before the repair
};

// Repairs the faces of a source, whose vertices have these positions. `welded` is the result of weld():
// corners with the same value have the same node, and other nodes are not closer than MeshLimits::minEdge.
// Indices must exist, and halves must be ascending.
//
// 1. Polygons become triangles, and also quads that are not convex (triangulation.h).
// 2. Triangles that have a node twice, or that are flat, are dropped. So are triangles with the nodes of an
//    earlier one.
// 3. An edge that more than two triangles have is split: two of them stay neighbours, those that continue
// each
//    other most smoothly, and the others become separate. Where this leaves more than two triangles at an
//    edge, all become separate.
// 4. Triangles are turned so that neighbours have their fronts on one side: that outside if their piece is
//    closed, else as few of each piece as possible. Neighbours for which this is impossible become separate.
// 5. A node gets a copy for each further fan of neighbouring triangles around it.
//
// The order of faces, parts and texture coordinates is kept. Returns an error that says what to do if no face
// is left, if a polygon cannot be divided, or if there would be more vertices than the limit. Adds to
// `repairs`.
[[nodiscard]] tl::expected<RepairedMesh, MeshError> repairMesh(const MeshSource& source,
                                                               const std::vector<model::Vec3>& placed,
                                                               const std::vector<std::uint32_t>& welded,
                                                               const MeshLimits& limits, Repairs& repairs);

}  // namespace clothstream::meshes
