// SPDX-License-Identifier: MIT
// Codec 1: packets to vertices.

#include <array>
#include <new>
#include <utility>

#include <zstd.h>

#include "proto/codec/array.h"
#include "proto/codec/body.h"
#include "proto/codec/lattice/lattice.h"
#include "proto/codec/lattice/prediction.h"
#include "proto/codec/lattice/residual_planes.h"
#include "proto/codec/octahedral.h"
#include "proto/codec/reconstruction_hash.h"

namespace clothstream::codec {
namespace {

// A frame's integers, channel after channel.
struct Integers {
  Array<std::int32_t> positions;
  Array<std::int8_t> normals;
};

// Codec 1's first section.
struct Modes {
  std::size_t planeCount = 0;
  Prediction position = Prediction::average, normal = Prediction::average;
};

bool readPrediction(std::byte value, PacketKind kind, Prediction& out) {
  if (static_cast<std::size_t>(value) >= kPredictionCount) return false;
  out = static_cast<Prediction>(value);
  return kind == PacketKind::predicted || !needsReference(out);
}

bool readModes(std::span<const std::byte> section, PacketKind kind, bool hasNormals, Modes& out) {
  if (section.size() != (hasNormals ? 3u : 2u)) return false;
  out.planeCount = static_cast<std::size_t>(section[0]);
  if (out.planeCount > kMaxPlanes || !readPrediction(section[1], kind, out.position)) return false;
  return !hasNormals || readPrediction(section[2], kind, out.normal);
}

// The section is one zstd frame, whole, of a plane of exactly this size.
bool decompress(ZSTD_DCtx* context, std::span<const std::byte> section, std::byte* plane, std::size_t bytes) {
  if (ZSTD_getFrameContentSize(section.data(), section.size()) != bytes) return false;
  if (ZSTD_findFrameCompressedSize(section.data(), section.size()) != section.size()) return false;
  return ZSTD_decompressDCtx(context, plane, bytes, section.data(), section.size()) == bytes;
}

// Whether all are lattice coordinates. No early way out: the loop is one of vectors then.
bool areWithinLattice(const std::int32_t* values, std::size_t count) {
  std::uint32_t outside = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t shifted = static_cast<std::uint32_t>(values[i]) + kLatticeLimit;
    outside |= shifted > 2u * kLatticeLimit ? 1u : 0u;
  }
  return outside == 0;
}

class LatticeDecoder final : public BodyDecoder {
 public:
  ~LatticeDecoder() override { ZSTD_freeDCtx(context_); }

  bool allocate(const StreamLayout& layout) {
    layout_ = layout;
    vertexCount_ = layout.vertexCount();
    hasNormals_ = layout.normals == NormalMode::octahedral;
    scale_ = latticeScale(layout.maxError);
    context_ = ZSTD_createDCtx();
    bool allocated = context_ != nullptr;
    for (Integers* integers : {&present_, &next_}) {
      allocated = allocated && integers->positions.allocate(kPositionChannels * vertexCount_) &&
                  integers->normals.allocate(hasNormals_ ? kNormalChannels * vertexCount_ : 0);
    }
    for (Array<std::byte>& plane : planes_) {
      allocated = allocated && plane.allocate(positionPlaneBytes(vertexCount_));
    }
    return allocated;
  }

  bool decode(const ParsedPacket& packet, std::uint8_t referenceLayer) override;
  void writePositions(float* out) const override;
  void writeNormals(float* out) const override;
  std::uint64_t reconstructionHash() const override;

 private:
  bool decodePositions(const Modes& modes);
  bool decodeNormals(const Modes& modes, std::span<const std::byte> section);

  StreamLayout layout_;
  std::size_t vertexCount_ = 0;
  bool hasNormals_ = false;
  LatticeScale scale_{};
  ZSTD_DCtx* context_ = nullptr;
  Integers present_, next_;  // `next_` becomes `present_` when all of a packet is decoded
  std::array<Array<std::byte>, kMaxPlanes> planes_;
};

bool LatticeDecoder::decode(const ParsedPacket& packet, std::uint8_t) {
  const PacketHeader& header = packet.header;
  if (header.sectionCount == 0) return false;
  std::size_t start = 0, index = 0;
  const auto nextSection = [&] {
    const std::span<const std::byte> section = packet.body.subspan(start, header.sectionBytes[index]);
    start += header.sectionBytes[index++];
    return section;
  };
  Modes modes;
  if (!readModes(nextSection(), header.kind, hasNormals_, modes)) return false;
  if (header.sectionCount != 1 + modes.planeCount + (hasNormals_ ? 1 : 0)) return false;
  for (std::size_t p = 0; p < modes.planeCount; ++p) {
    if (!decompress(context_, nextSection(), planes_[p].data(), planes_[p].size())) return false;
  }
  if (!decodePositions(modes) || (hasNormals_ && !decodeNormals(modes, nextSection()))) return false;
  std::swap(present_, next_);
  return true;
}

bool LatticeDecoder::decodePositions(const Modes& modes) {
  const std::array<const std::byte*, kMaxPlanes> sources{planes_[0].data(), planes_[1].data(),
                                                         planes_[2].data(), planes_[3].data()};
  for (std::size_t c = 0; c < kPositionChannels; ++c) {
    const std::size_t offset = c * vertexCount_;
    std::int32_t* values = next_.positions.data() + offset;
    mergePlanes(sources, modes.planeCount, offset, vertexCount_, values);
    codec::reconstruct(layout_, modes.position, values, present_.positions.data() + offset, values);
  }
  return areWithinLattice(next_.positions.data(), next_.positions.size());
}

bool LatticeDecoder::decodeNormals(const Modes& modes, std::span<const std::byte> section) {
  std::byte* plane = planes_[0].data();
  if (!decompress(context_, section, plane, normalPlaneBytes(vertexCount_))) return false;
  mergePlane(plane, normalPlaneBytes(vertexCount_), next_.normals.data());
  for (std::size_t c = 0; c < kNormalChannels; ++c) {
    std::int8_t* values = next_.normals.data() + c * vertexCount_;
    codec::reconstruct(layout_, modes.normal, values, present_.normals.data() + c * vertexCount_, values);
  }
  return true;
}

void LatticeDecoder::writePositions(float* out) const {
  for (std::size_t c = 0; c < kPositionChannels; ++c) {
    const std::int32_t* values = present_.positions.data() + c * vertexCount_;
    for (std::size_t i = 0; i < vertexCount_; ++i) out[3 * i + c] = codec::reconstruct(values[i], scale_);
  }
}

void LatticeDecoder::writeNormals(float* out) const {
  const std::int8_t* u = present_.normals.data();
  for (std::size_t i = 0; i < vertexCount_; ++i) decodeOctahedral({u[i], u[vertexCount_ + i]}, out + 3 * i);
}

std::uint64_t LatticeDecoder::reconstructionHash() const {
  return hashFrame(vertexCount_, present_.positions.data(), hasNormals_ ? present_.normals.data() : nullptr);
}

}  // namespace

std::unique_ptr<BodyDecoder> makeLatticeDecoder(const StreamLayout& layout) {
  std::unique_ptr<LatticeDecoder> decoder(new (std::nothrow) LatticeDecoder);
  if (decoder == nullptr || !decoder->allocate(layout)) return nullptr;
  return decoder;
}

}  // namespace clothstream::codec
