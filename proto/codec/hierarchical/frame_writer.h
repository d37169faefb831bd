// SPDX-License-Identifier: MIT
// Residuals, and the scales at which they are expected, to a packet: all of encoding that is not prediction.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/body.h"
#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/rans.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/packet_header.h"

namespace clothstream::codec::hierarchical {

// Of the vertices of a chunk, by component (residual_model.h). What `stays` has no other residuals, and has
// none along u and v.
struct ChunkResiduals {
  std::int32_t* residual(Component component) { return residuals[component].data(); }
  const std::int32_t* residual(Component component) const { return residuals[component].data(); }

  alignas(16) std::array<std::array<std::int32_t, kChunk>, kComponents> residuals;
  alignas(16) std::array<std::array<std::int32_t, kChunk>, kComponents> scales;
  std::array<bool, kChunk> stays{};
  bool anyStays = false;
};

// A frame is begin(), then for each phase beginPhase(), add() for its chunks and endPhase(), addNormal()
// where the stream has them, then write().
class FrameWriter {
 public:
  explicit FrameWriter(const StreamLayout& layout);

  std::size_t packetBound() const;

  void begin();
  void beginPhase();
  void add(const ChunkResiduals& chunk, std::size_t count);
  // `any`: one of its vertices stays or has a residual that is not 0.
  void endPhase(bool any);
  // That was the last phase of coarse vertices.
  void endCoarse();
  // In the order of vertices: what u and v are off the prediction, modulo 256.
  void addNormal(std::int8_t u, std::int8_t v);
  // The packet; `weights` is its first section.
  std::size_t write(const FrameRole& role, std::span<const std::byte> weights, std::span<std::byte> out);

 private:
  void code(const ChunkResiduals& chunk, Component component, std::size_t i);
  // `reserved`: how many of the escapes' numbers stand for something else.
  void put(std::int32_t residual, Component component, std::uint32_t scale, std::uint32_t reserved,
           std::size_t coder);

  PacketHeader header_;
  RansWriter symbols_;
  std::vector<std::byte> extra_;
  BitWriter bits_, bitsBefore_;  // before the phase
  std::size_t symbolsBefore_ = 0;
  std::array<NormalScale, 2> normalScales_;
  std::uint32_t normals_ = 0;  // that were added
  // What coarse vertices take.
  std::size_t coarseSymbols_ = 0, coarseBytes_ = 0;
};

}  // namespace clothstream::codec::hierarchical
