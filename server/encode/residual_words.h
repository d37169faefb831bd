// SPDX-License-Identifier: MIT
// Words of residuals that the device writes (shaders/encode/hierarchical/hierarchical.h).
#pragma once

#include <cstdint>
#include <span>

#include "proto/codec/hierarchical/frame_writer.h"

namespace clothstream::encode {

// Residuals of consecutive slots, at most codec::hierarchical::kChunk.
struct ResidualWords {
  std::span<const std::uint32_t> first, second;  // one each per slot
  std::span<const std::int32_t> wide;            // three per slot, valid where they are needed
};

// Returns true if a vertex stays or has a residual other than 0.
bool unpackResiduals(const ResidualWords& words, codec::hierarchical::ChunkResiduals& out);

}  // namespace clothstream::encode
