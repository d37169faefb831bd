// SPDX-License-Identifier: MIT
// Which faces meet in each vertex, as the kernel that predicts normals reads it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::encode {

struct NormalTables {
  std::vector<std::array<std::uint32_t, 4>> faces;  // slots of the corners; shared::kNoCorner
  // By vertex: where its faces start, and where those of the last end; then these, one vertex after the
  // other.
  std::vector<std::uint32_t> facesOf;
};

// Quads of grids and triangles of meshes (proto/codec/hierarchical/normal_prediction.h).
NormalTables makeNormalTables(const codec::StreamLayout& layout,
                              const codec::hierarchical::Hierarchy& hierarchy);

}  // namespace clothstream::encode
