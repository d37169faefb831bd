// SPDX-License-Identifier: MIT
// Separates triangles into sheets: two triangles at an edge at most, with their fronts on one side.
#pragma once

#include <cstdint>
#include <vector>

#include "server/meshes/repairs.h"
#include "server/model/cancellation.h"
#include "server/model/mesh.h"

namespace clothstream::meshes {

struct SheetTriangle {
  model::Triangle nodes = {}, uvs = {};
  std::uint32_t face = 0;    // of the source
  bool isFirstHalf = false;  // of a quad, with the next triangle
};

// Steps 3 to 5 of repairMesh(). `placed` and `origin` get an element for each copy of a node. Triangles have
// three different nodes that exist, and no two triangles have the same three. Returns false, and leaves its
// arguments as they are, if there would be more than `maxNodes` nodes with triangles. Adds to `repairs`.
[[nodiscard]] bool separateSheets(std::vector<SheetTriangle>& triangles, std::vector<model::Vec3>& placed,
                                  std::vector<std::uint32_t>& origin, std::uint64_t maxNodes,
                                  const model::Cancellation& cancellation, Repairs& repairs);

}  // namespace clothstream::meshes
