// SPDX-License-Identifier: MIT
// Writes residuals and their expected scales as a packet, in symbols by rANS and bits: everything in encoding
// that is not prediction.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/frame_role.h"
#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/normal_prediction.h"
#include "proto/codec/hierarchical/packet_assembly.h"
#include "proto/codec/hierarchical/predictor.h"
#include "proto/codec/hierarchical/rans.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

// Residuals of the vertices of a chunk, by component (residual_model.h). A vertex that `stays` has no
// residuals along u and v.
struct ChunkResiduals {
  std::int32_t* residual(Component component) { return residuals[component].data(); }
  const std::int32_t* residual(Component component) const { return residuals[component].data(); }

  alignas(16) std::array<std::array<std::int32_t, kChunk>, kComponents> residuals;
  alignas(16) std::array<std::array<std::int32_t, kChunk>, kComponents> scales;
  std::array<bool, kChunk> stays{};
  bool anyStays = false;
};

// The calls for a frame are begin(); for each phase beginPhase(), add() for its chunks and endPhase();
// addNormal() for each vertex if the stream sends normals; write().
class FrameWriter {
 public:
  explicit FrameWriter(const StreamLayout& layout);

  std::size_t packetBound() const;

  void begin();
  void beginPhase();
  void add(const ChunkResiduals& chunk, std::size_t count);
  // `any`: a vertex of the phase stays or has a residual that is not 0.
  void endPhase(bool any);
  // Marks the end of the last phase of coarse vertices.
  void endCoarse();
  // Residuals of a normal, modulo 256. Called in the order of vertices.
  void addNormal(std::int8_t u, std::int8_t v);
  // Writes the packet and returns its size; `weights` is its first section.
  std::size_t write(const FrameRole& role, std::span<const std::byte> weights, std::span<std::byte> out);

 private:
  void code(const ChunkResiduals& chunk, Component component, std::size_t i);
  // `reserved`: number of escape values with another meaning.
  void put(std::int32_t residual, Component component, std::uint32_t scale, std::uint32_t reserved,
           std::size_t coder);

  PacketAssembly packet_;
  RansWriter symbols_;
  std::vector<std::byte> extra_;
  BitWriter bits_, bitsBefore_;  // the second is the state before the phase
  std::size_t symbolsBefore_ = 0;
  std::array<NormalScale, 2> normalScales_;
  std::uint32_t normals_ = 0;  // normals added so far
  // Symbols and bytes that the coarse vertices take.
  std::size_t coarseSymbols_ = 0, coarseBytes_ = 0;
};

}  // namespace clothstream::codec::hierarchical
