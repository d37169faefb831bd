// SPDX-License-Identifier: MIT
// What a codec does with the part of a packet behind the header. Who refers to what, and whether a packet is
// for this stream, is checked before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "proto/codec/coarse_packet.h"
#include "proto/codec/encoder.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// What a frame is to the others of its stream.
struct FrameRole {
  std::uint64_t tick = 0;
  PacketKind kind = PacketKind::key;
  std::uint8_t layer = 0;
  // Of no meaning for a key frame.
  std::uint8_t referenceLayer = 0;  // it refers to the newest frame of that layer,
  std::uint64_t referenceTick = 0;  // of this tick
  std::uint8_t quality = 0;         // of this frame and its references
};

class BodyDecoder {
 public:
  virtual ~BodyDecoder() = default;
  // False where the sections are not those of a frame of this layout; then nothing has changed.
  // A predicted frame refers to the newest one of that layer.
  [[nodiscard]] virtual bool decode(const ParsedPacket& packet, std::uint8_t referenceLayer) = 0;
  // Of the newest frame: 3 floats a vertex.
  virtual void writePositions(float* out) const = 0;
  // Only where the stream sends normals.
  virtual void writeNormals(float* out) const = 0;
  virtual std::uint64_t reconstructionHash() const = 0;
};

class BodyEncoder {
 public:
  virtual ~BodyEncoder() = default;
  virtual std::size_t packetBound() const = 0;
  // A whole packet, header and all; the rest as in Encoder::encode().
  virtual std::size_t encode(const FrameRole& role, std::span<const float> positions,
                             std::span<const float> normals, std::span<std::byte> out) = 0;
  // Of the newest frame.
  virtual std::uint64_t reconstructionHash() const = 0;
};

// Those of each codec, for a layout that is possible; decoders are null if memory is out. An encoder's layout
// has the max error of its quality.
std::unique_ptr<BodyDecoder> makeHierarchicalDecoder(const StreamLayout& layout, Detail detail);
std::unique_ptr<BodyEncoder> makeHierarchicalEncoder(const StreamLayout& layout,
                                                     const EncoderOptions& options);

}  // namespace clothstream::codec
