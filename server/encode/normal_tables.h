// SPDX-License-Identifier: MIT
// Tables of the faces that meet at each vertex, for the kernel that predicts normals.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::encode {

struct NormalTables {
  std::vector<std::array<std::uint32_t, 4>> faces;  // slots of the corners; shared::kNoCorner
  // By vertex: start of its faces, and the end of the last vertex's faces. Then the faces, vertex by vertex.
  std::vector<std::uint32_t> facesOf;
};

// Tables for quads of grids and triangles of meshes (proto/codec/hierarchical/normal_prediction.h).
NormalTables makeNormalTables(const codec::StreamLayout& layout,
                              const codec::hierarchical::Hierarchy& hierarchy);

}  // namespace clothstream::encode
