// SPDX-License-Identifier: MIT
// Codecs of other libraries for the positions of a frame, at the same max error.
#pragma once

#include <memory>
#include <vector>

#include "proto/codec/stream_layout.h"
#include "tests/bench/codec/frame_codec.h"

namespace clothstream::bench {

// Bits of the lattice that all but raw floats round to. Its step is twice the max error, and it reaches
// 32,768 steps from the origin each way. Vertices beyond it end the measurement.
inline constexpr int kLatticeBits = 16;

// Each knows the cloth beforehand, as ours do. The exception is Draco, which sends the triangles with each
// frame and has a different order of vertices.
std::vector<std::unique_ptr<FrameCodec>> peerCodecs(const codec::ClothLayout& cloth, double maxError);

// 12 bytes a vertex, lossless.
std::unique_ptr<FrameCodec> rawFloats();

}  // namespace clothstream::bench
