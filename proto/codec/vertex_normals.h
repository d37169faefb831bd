// SPDX-License-Identifier: MIT
// Vertex normals from positions, for streams that send none: [Va21] 3.5, Alg. 5.
#pragma once

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// `positions` and `normals` have 3 floats a vertex. A normal is the normalised sum of cross products over the
// faces round the vertex p. A quad of a grid with neighbours A and B (counter-clockwise) and diagonal C adds
// (C - p) x (B - A). A triangle (p, q, r) adds (q - p) x (r - p). If the sum vanishes, the normal is (0, 0,
// 1).
void computeVertexNormals(const StreamLayout& layout, const float* positions, float* normals);

}  // namespace clothstream::codec
