// SPDX-License-Identifier: MIT
// Writer of packets of codec 2: symbols by rANS, and bits.
#pragma once

#include <array>
#include <vector>

#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_writer.h"
#include "proto/codec/hierarchical/normal_prediction.h"
#include "proto/codec/hierarchical/packet_assembly.h"
#include "proto/codec/hierarchical/rans.h"

namespace clothstream::codec::hierarchical {

class RansFrameWriter final : public FrameWriter {
 public:
  explicit RansFrameWriter(const StreamLayout& layout);

  std::size_t packetBound() const override;
  bool needsScales() const override { return true; }
  void begin() override;
  void beginPhase() override;
  void add(const ChunkResiduals& chunk, std::size_t count) override;
  void endPhase(bool any) override;
  void endCoarse() override;
  void addNormal(std::int8_t u, std::int8_t v) override;
  std::size_t write(const FrameRole& role, std::span<const std::byte> weights,
                    std::span<std::byte> out) override;

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
