// SPDX-License-Identifier: MIT
// Other libraries' codecs for the positions of a frame, at the same largest error.
#pragma once

#include <memory>
#include <vector>

#include "proto/codec/stream_layout.h"
#include "tests/bench/codec/frame_codec.h"

namespace clothstream::bench {

// Of the lattice that all but raw floats round to: its step is twice the max error, and it reaches 32,768
// steps from the origin each way; whatever lies beyond ends the measurement.
inline constexpr int kLatticeBits = 16;

// Each knows the cloth beforehand, as ours do, but for Draco, which sends the triangles with each frame and
// the vertices in an order of its own.
std::vector<std::unique_ptr<FrameCodec>> peerCodecs(const codec::ClothLayout& cloth, double maxError);

// 12 bytes a vertex; nothing is lost, whatever the max error.
std::unique_ptr<FrameCodec> rawFloats();

}  // namespace clothstream::bench
