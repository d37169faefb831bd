// SPDX-License-Identifier: MIT
// Writer of packets of codec 3: residuals in blocks (packed_blocks.h).
#pragma once

#include <array>
#include <vector>

#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_writer.h"
#include "proto/codec/hierarchical/packed_blocks.h"
#include "proto/codec/hierarchical/packet_assembly.h"

namespace clothstream::codec::hierarchical {

class PackedFrameWriter final : public FrameWriter {
 public:
  explicit PackedFrameWriter(const StreamLayout& layout);

  std::size_t packetBound() const override;
  bool needsScales() const override { return false; }
  void begin() override { vertices_ = normals_ = coarse_ = 0; }
  void beginPhase() override {}
  void add(const ChunkResiduals& chunk, std::size_t count) override;
  void endPhase(bool) override {}
  void endCoarse() override { coarse_ = vertices_; }
  void addNormal(std::int8_t u, std::int8_t v) override;
  std::size_t write(const FrameRole& role, std::span<const std::byte> weights,
                    std::span<std::byte> out) override;

 private:
  PacketAssembly packet_;
  // By component in kCodingOrder, then by slot; those of normals by vertex.
  std::array<std::vector<std::uint32_t>, kComponents> numbers_;
  std::array<std::vector<std::uint32_t>, 2> normalNumbers_;
  std::size_t vertices_ = 0, coarse_ = 0, normals_ = 0;  // numbers added so far
};

}  // namespace clothstream::codec::hierarchical
