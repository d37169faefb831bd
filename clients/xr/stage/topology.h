// SPDX-License-Identifier: MIT
// What a cloth is drawn of: vertices that are separate at seams of texture coordinates, and the faces around
// each node.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "clients/xr/stage/stage.h"

namespace clothstream::xr {

// Triangles of one cloth or hull, in nodes counted from the first node of the stage.
struct Shape {
  std::uint32_t firstNode = 0, nodeCount = 0;
  std::uint32_t rows = 0, columns = 0;       // above 1 for a grid
  std::span<const float> positions;          // 3 per node, from its first node; at rest
  std::span<const std::uint32_t> corners;    // 3 nodes per triangle
  std::span<const float> uvs;                // pairs; empty without texture coordinates
  std::span<const std::uint32_t> uvIndices;  // one for each corner; empty without texture coordinates
};

// Appends the shape's drawn vertices and indices to the stage, and its faces to the lists of its nodes.
// Shapes are appended in the order of their nodes, without gaps. Corners outside of the shape's nodes are not
// allowed. Returns whether it has texture coordinates.
bool append(const Shape& shape, Stage& stage);

}  // namespace clothstream::xr
