// SPDX-License-Identifier: MIT
// Decoder of codec 2: turns the part of a packet after the header into vertices. Decoder
// (proto/codec/decoder.h) has already checked that the packet belongs to the stream and that its reference is
// held.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/codec/coarse_packet.h"
#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/rans.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

class HierarchicalDecoder {
 public:
  // False if memory is out. Call it once, before anything else.
  [[nodiscard]] bool allocate(const StreamLayout& layout, Detail detail);

  // A predicted frame refers to the newest frame. False if the sections are not a frame of this layout; then
  // the decoder is unchanged.
  [[nodiscard]] bool decode(const ParsedPacket& packet);
  // Positions and normals of the newest frame, 3 floats a vertex.
  void writePositions(float* out) const;
  // Only if the stream sends normals.
  void writeNormals(float* out) const;
  std::uint64_t reconstructionHash() const;

 private:
  struct Streams {
    RansReader symbols;
    BitReader bits;
    std::size_t coarseSymbols, coarseBits;  // bytes that the coarse vertices take

    bool isCoarseRead() const {
      return symbols.bytesTaken() == coarseSymbols && bits.bytesTaken() == coarseBits;
    }
  };
  using Vectors = std::array<WeightVectors, kWeightClasses + 1>;

  bool decodeFrame(const ParsedPacket& packet);
  Streams openStreams(const ParsedPacket& packet) const;
  void decodePhases(std::size_t begin, std::size_t end, bool key, const Vectors& weights, Streams& streams);
  void decodeNormals(Streams& streams);
  std::int32_t readOfNormal(std::size_t component, std::size_t vertex, NormalScale& scale, Streams& streams);
  // A null model means that the chunk has no residuals.
  void decodeChunk(std::uint32_t begin, std::uint32_t count, const WeightVectors& weights,
                   const ScaleModel* model, Streams& streams);
  void readResiduals(std::uint32_t count, const ScaleModel& model, Streams& streams);
  void readComponent(Component component, std::uint32_t count, Streams& streams);
  bool isOutside() const { return (beyond_.signs() & 7) != 0; }
  template <bool within>
  void readSymbols(Component component, std::uint32_t count, RansReader& reader);
  void completeResiduals(Component component, std::uint32_t first, std::uint32_t count, BitReader& bits);
  std::uint32_t readEscaped(Component component, std::size_t i, BitReader& bits);
  void reconstruct(std::uint32_t begin, std::uint32_t count);
  void place(std::uint32_t begin, std::uint32_t count, const Prediction* predictions,
             const std::array<Int32x4, 4>& positions, Int32x4 magnitudes);

  StreamLayout layout_;
  bool isCoarse_ = false, hasNormals_ = false;
  LatticeUnit unit_{};
  Predictor predictor_;
  NormalPrediction normalPrediction_;
  // by vertex; the second are those of the frame that is being decoded
  Array<FacedNormal> normals_, newNormals_;
  Weights weights_{};  // left by the newest frame
  Int32x4 beyond_{};   // set where a coordinate of this frame exceeds kMaxCoordinate
  // State of the chunk that is being decoded.
  std::array<Prediction, kChunk> predictions_{};
  std::array<SurfaceFrames, kChunk / 4> frames_;
  alignas(16) std::int32_t residuals_[kComponents][kChunk] = {};
  alignas(16) std::int32_t scales_[kChunk];
  std::array<bool, kChunk> stays_{};
  bool anyStays_ = false;
};

}  // namespace clothstream::codec::hierarchical
