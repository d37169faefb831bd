// SPDX-License-Identifier: MIT
// Writes residuals and their expected scales as a packet: everything in encoding that is not prediction.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "proto/codec/frame_role.h"
#include "proto/codec/hierarchical/predictor.h"
#include "proto/codec/hierarchical/residual_model.h"

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
  virtual ~FrameWriter() = default;

  virtual std::size_t packetBound() const = 0;
  // True if add() reads the chunk's scales.
  virtual bool needsScales() const = 0;

  virtual void begin() = 0;
  virtual void beginPhase() = 0;
  virtual void add(const ChunkResiduals& chunk, std::size_t count) = 0;
  // `any`: a vertex of the phase stays or has a residual that is not 0.
  virtual void endPhase(bool any) = 0;
  // Marks the end of the last phase of coarse vertices.
  virtual void endCoarse() = 0;
  // Residuals of a normal, modulo 256. Called in the order of vertices.
  virtual void addNormal(std::int8_t u, std::int8_t v) = 0;
  // Writes the packet and returns its size; `weights` is its first section.
  virtual std::size_t write(const FrameRole& role, std::span<const std::byte> weights,
                            std::span<std::byte> out) = 0;
};

// Writer for the layout's codec.
std::unique_ptr<FrameWriter> makeFrameWriter(const StreamLayout& layout);

}  // namespace clothstream::codec::hierarchical
