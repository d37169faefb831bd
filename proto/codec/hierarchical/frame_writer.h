// SPDX-License-Identifier: MIT
// Residuals, and the scales at which they are expected, to a packet: all of encoding that is not prediction.
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
  virtual ~FrameWriter() = default;

  virtual std::size_t packetBound() const = 0;
  // Whether add() reads the chunk's scales.
  virtual bool needsScales() const = 0;

  virtual void begin() = 0;
  virtual void beginPhase() = 0;
  virtual void add(const ChunkResiduals& chunk, std::size_t count) = 0;
  // `any`: one of its vertices stays or has a residual that is not 0.
  virtual void endPhase(bool any) = 0;
  // That was the last phase of coarse vertices.
  virtual void endCoarse() = 0;
  // In the order of vertices: what u and v are off the prediction, modulo 256.
  virtual void addNormal(std::int8_t u, std::int8_t v) = 0;
  // The packet; `weights` is its first section.
  virtual std::size_t write(const FrameRole& role, std::span<const std::byte> weights,
                            std::span<std::byte> out) = 0;
};

// That of the layout's codec.
std::unique_ptr<FrameWriter> makeFrameWriter(const StreamLayout& layout);

}  // namespace clothstream::codec::hierarchical
