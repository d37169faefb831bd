// SPDX-License-Identifier: MIT
// Vertex normals from positions, where a stream sends none: [Va21] 3.5, Alg. 5.
#pragma once

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// `positions` and `normals`: 3 floats a vertex. For each quad round a vertex p with neighbours A and B along
// the grid (counter-clockwise) and diagonal C, the cross product (C - p) x (B - A); of a cloth that is no
// grid, for each triangle (p, q, r) the cross product (q - p) x (r - p); their sum, normalised. (0, 0, 1)
// where the sum vanishes.
void computeVertexNormals(const StreamLayout& layout, const float* positions, float* normals);

}  // namespace clothstream::codec
