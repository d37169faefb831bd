// SPDX-License-Identifier: MIT
// Residuals to packets: codec 1's sections, entropy-coded with zstd.
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "proto/codec/lattice/residual_planes.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// One a stream; not thread-safe. Memory is taken once, at construction.
class PacketWriter {
 public:
  // The layout must be possible.
  explicit PacketWriter(const StreamLayout& layout);
  ~PacketWriter();
  PacketWriter(const PacketWriter&) = delete;
  PacketWriter& operator=(const PacketWriter&) = delete;

  // Largest number of bytes that a packet can take.
  std::size_t packetBound() const;

  // Writes to `out` (at least packetBound() bytes) and returns the number of bytes written. Planes have the
  // sizes of positionPlaneBytes and normalPlaneBytes.
  std::size_t write(const FrameResiduals& frame, std::span<std::byte> out);

 private:
  struct Compressor;
  std::size_t vertexCount_;
  bool hasNormals_;
  PacketHeader header_;
  std::unique_ptr<Compressor> compressor_;
};

}  // namespace clothstream::codec
