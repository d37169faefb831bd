// SPDX-License-Identifier: MIT
// Residuals to packets.
#include "proto/codec/lattice/packet_writer.h"

#include <cassert>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <zstd.h>

namespace clothstream::codec {
namespace {

// Measured on cloth in motion: residuals have next to no repetitions, and the few that there are cost more
// bits than the literals they replace. So matches are kept rare (long ones only, by the smallest table),
// which leaves Huffman coding; a higher level takes three times as long for the same size.
constexpr int kCompressionLevel = 1;
constexpr int kShortestMatch = 7;
constexpr int kMatchTableLog = 6;

constexpr std::size_t kMaxModeBytes = 3;

}  // namespace

struct PacketWriter::Compressor {
  Compressor() : context(ZSTD_createCCtx()) {
    if (context == nullptr) std::abort();  // memory is out, as of any other allocation here
    set(ZSTD_c_compressionLevel, kCompressionLevel);
    set(ZSTD_c_minMatch, kShortestMatch);
    set(ZSTD_c_hashLog, kMatchTableLog);
  }
  ~Compressor() { ZSTD_freeCCtx(context); }
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  std::size_t compress(std::span<const std::byte> plane, std::span<std::byte> out) {
    const std::size_t written = ZSTD_compress2(context, out.data(), out.size(), plane.data(), plane.size());
    assert(!ZSTD_isError(written));  // `out` holds the bound
    return written;
  }

  void set(ZSTD_cParameter parameter, int value) {
    [[maybe_unused]] const std::size_t result = ZSTD_CCtx_setParameter(context, parameter, value);
    assert(!ZSTD_isError(result));
  }

  ZSTD_CCtx* context;
};

PacketWriter::PacketWriter(const StreamLayout& layout)
    : vertexCount_(layout.vertexCount()),
      hasNormals_(layout.normals == NormalMode::octahedral),
      compressor_(std::make_unique<Compressor>()) {
  assert(isPossible(layout));
  header_.epoch = layout.epoch;
  header_.rangeCount = 1;
  header_.ranges[0] = {0, static_cast<std::uint32_t>(layout.cloths.size())};
  // The context takes its memory when it first sees a plane of full size.
  const std::vector<std::byte> plane(positionPlaneBytes(vertexCount_));
  std::vector<std::byte> out(ZSTD_compressBound(plane.size()));
  compressor_->compress(plane, out);
}

PacketWriter::~PacketWriter() = default;

std::size_t PacketWriter::packetBound() const {
  PacketHeader largest = header_;
  largest.kind = PacketKind::predicted;
  largest.referenceCount = 1;
  largest.sectionCount = kMaxSections;
  return headerBound(largest) + kMaxModeBytes +
         kMaxPlanes * ZSTD_compressBound(positionPlaneBytes(vertexCount_)) +
         (hasNormals_ ? ZSTD_compressBound(normalPlaneBytes(vertexCount_)) : 0);
}

std::size_t PacketWriter::write(const FrameResiduals& frame, std::span<std::byte> out) {
  assert(out.size() >= packetBound());
  assert(frame.planeCount <= kMaxPlanes);
  PacketHeader& header = header_;
  header.kind = frame.kind;
  header.tick = frame.tick;
  header.referenceCount = frame.kind == PacketKind::predicted ? 1 : 0;
  header.references[0] = frame.referenceTick;
  header.sectionCount = static_cast<std::uint8_t>(1 + frame.planeCount + (hasNormals_ ? 1 : 0));

  // The header's length depends on the sections' sizes: they are written behind its bound and moved up.
  const std::size_t bodyStart = headerBound(header);
  std::size_t end = bodyStart;
  std::size_t section = 0;
  out[end++] = static_cast<std::byte>(frame.planeCount);
  out[end++] = static_cast<std::byte>(frame.positionPrediction);
  if (hasNormals_) out[end++] = static_cast<std::byte>(frame.normalPrediction);
  header.sectionBytes[section++] = static_cast<std::uint32_t>(end - bodyStart);
  const auto addPlane = [&](std::span<const std::byte> plane) {
    const std::size_t written = compressor_->compress(plane, out.subspan(end));
    header.sectionBytes[section++] = static_cast<std::uint32_t>(written);
    end += written;
  };
  for (std::size_t p = 0; p < frame.planeCount; ++p) {
    assert(frame.planes[p].size() == positionPlaneBytes(vertexCount_));
    addPlane(frame.planes[p]);
  }
  if (hasNormals_) {
    assert(frame.normalPlane.size() == normalPlaneBytes(vertexCount_));
    addPlane(frame.normalPlane);
  }
  const std::size_t headerBytes = writeHeader(header, out);
  std::memmove(out.data() + headerBytes, out.data() + bodyStart, end - bodyStart);
  return headerBytes + (end - bodyStart);
}

}  // namespace clothstream::codec
