// SPDX-License-Identifier: MIT
// Encoder of codec 2: vertices to packets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "proto/codec/encoder.h"
#include "proto/codec/frame_role.h"

namespace clothstream::codec::hierarchical {

// A residual with the values that were known when it was coded. residual_tables.cpp is fitted to these.
struct CodedResidual {
  std::uint8_t component, scaleClass;
  std::uint8_t parents, ring, last, normal, u;  // magnitudes that ScaleWeights multiplies
  std::int32_t residual;
};

class HierarchicalEncoder {
 public:
  // `layout` has the max error of the quality that is encoded.
  explicit HierarchicalEncoder(const StreamLayout& layout, const EncoderOptions& options = {});
  ~HierarchicalEncoder();

  std::size_t packetBound() const;
  // Writes a whole packet, header included; see Encoder::encode().
  std::size_t encode(const FrameRole& role, std::span<const float> positions, std::span<const float> normals,
                     std::span<std::byte> out);
  // Hash of the newest frame.
  std::uint64_t reconstructionHash() const;

  // Appends every residual that is coded from now on to `residuals`; null stops it. Requires an encoder
  // without workers.
  void record(std::vector<CodedResidual>* residuals);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::codec::hierarchical
