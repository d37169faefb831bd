// SPDX-License-Identifier: MIT
// Packets to vertices.
#include "proto/codec/decoder.h"

#include <array>
#include <cassert>
#include <new>
#include <utility>

#include <zstd.h>

#include "proto/codec/lattice.h"
#include "proto/codec/octahedral.h"
#include "proto/codec/prediction.h"
#include "proto/codec/reconstruction_hash.h"
#include "proto/codec/residual_planes.h"
#include "proto/codec/vertex_normals.h"

namespace clothstream::codec {
namespace {

// An array whose allocation may fail without an exception; not cleared.
template <typename T>
class Array {
 public:
  bool allocate(std::size_t size) {
    values_.reset(new (std::nothrow) T[size]);
    size_ = values_ == nullptr ? 0 : size;
    return values_ != nullptr;
  }
  T* data() const { return values_.get(); }
  std::size_t size() const { return size_; }

 private:
  std::unique_ptr<T[]> values_;
  std::size_t size_ = 0;
};

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

}  // namespace

struct Decoder::State {
  ~State() { ZSTD_freeDCtx(context); }

  bool allocate(const StreamLayout& streamLayout) {
    layout = streamLayout;
    vertexCount = layout.vertexCount();
    hasNormals = layout.normals == NormalMode::octahedral;
    scale = latticeScale(layout.maxError);
    context = ZSTD_createDCtx();
    bool allocated = context != nullptr;
    for (Integers* integers : {&present, &next}) {
      allocated = allocated && integers->positions.allocate(kPositionChannels * vertexCount) &&
                  integers->normals.allocate(hasNormals ? kNormalChannels * vertexCount : 0);
    }
    for (Array<std::byte>& plane : planes) {
      allocated = allocated && plane.allocate(positionPlaneBytes(vertexCount));
    }
    return allocated && positions.allocate(3 * vertexCount) && normals.allocate(3 * vertexCount);
  }

  DecodeResult decode(std::span<const std::byte> packet);
  bool decodeBody(const ParsedPacket& packet);
  bool decodePositions(const Modes& modes);
  bool decodeNormals(const Modes& modes, std::span<const std::byte> section);
  void reconstructPositions();
  void reconstructNormals();

  StreamLayout layout;
  std::size_t vertexCount = 0;
  bool hasNormals = false;
  LatticeScale scale{};
  ZSTD_DCtx* context = nullptr;
  Integers present, next;  // `next` becomes `present` when all of a packet is decoded
  std::array<Array<std::byte>, kMaxPlanes> planes;
  Array<float> positions, normals;
  std::uint64_t tick = 0;
  std::uint64_t hash = 0;
  bool hasFrame = false;
  // Of the newest frame; made when they are first asked for.
  bool hasHash = false, hasNormalFloats = false;
};

DecodeResult Decoder::State::decode(std::span<const std::byte> bytes) {
  const std::optional<ParsedPacket> packet = parsePacket(bytes);
  if (!packet || packet->header.codec != kCodecLatticeZstd) return DecodeResult::malformed;
  const PacketHeader& header = packet->header;
  if (header.epoch != layout.epoch) return DecodeResult::wrongEpoch;
  if (hasFrame && header.tick <= tick) return DecodeResult::stale;
  // A packet of this codec covers all cloths and refers to one frame.
  const ClothRange& range = header.ranges[0];
  if (header.rangeCount != 1 || range.first != 0 || range.count != layout.cloths.size())
    return DecodeResult::malformed;
  if (header.referenceCount > 1) return DecodeResult::malformed;
  if (header.kind == PacketKind::predicted && !(hasFrame && header.references[0] == tick)) {
    return DecodeResult::missingReference;
  }
  if (!decodeBody(*packet)) return DecodeResult::malformed;
  std::swap(present, next);
  tick = header.tick;
  hasFrame = true;
  hasHash = hasNormalFloats = false;
  reconstructPositions();
  return DecodeResult::ok;
}

bool Decoder::State::decodeBody(const ParsedPacket& packet) {
  const PacketHeader& header = packet.header;
  if (header.sectionCount == 0) return false;
  std::size_t start = 0, index = 0;
  const auto nextSection = [&] {
    const std::span<const std::byte> section = packet.body.subspan(start, header.sectionBytes[index]);
    start += header.sectionBytes[index++];
    return section;
  };
  Modes modes;
  if (!readModes(nextSection(), header.kind, hasNormals, modes)) return false;
  if (header.sectionCount != 1 + modes.planeCount + (hasNormals ? 1 : 0)) return false;
  for (std::size_t p = 0; p < modes.planeCount; ++p) {
    if (!decompress(context, nextSection(), planes[p].data(), planes[p].size())) return false;
  }
  return decodePositions(modes) && (!hasNormals || decodeNormals(modes, nextSection()));
}

bool Decoder::State::decodePositions(const Modes& modes) {
  const std::array<const std::byte*, kMaxPlanes> sources{planes[0].data(), planes[1].data(), planes[2].data(),
                                                         planes[3].data()};
  for (std::size_t c = 0; c < kPositionChannels; ++c) {
    const std::size_t offset = c * vertexCount;
    std::int32_t* values = next.positions.data() + offset;
    mergePlanes(sources, modes.planeCount, offset, vertexCount, values);
    codec::reconstruct(layout, modes.position, values, present.positions.data() + offset, values);
  }
  return areWithinLattice(next.positions.data(), next.positions.size());
}

bool Decoder::State::decodeNormals(const Modes& modes, std::span<const std::byte> section) {
  std::byte* plane = planes[0].data();
  if (!decompress(context, section, plane, normalPlaneBytes(vertexCount))) return false;
  mergePlane(plane, normalPlaneBytes(vertexCount), next.normals.data());
  for (std::size_t c = 0; c < kNormalChannels; ++c) {
    std::int8_t* values = next.normals.data() + c * vertexCount;
    codec::reconstruct(layout, modes.normal, values, present.normals.data() + c * vertexCount, values);
  }
  return true;
}

void Decoder::State::reconstructPositions() {
  for (std::size_t c = 0; c < kPositionChannels; ++c) {
    const std::int32_t* values = present.positions.data() + c * vertexCount;
    float* out = positions.data() + c;
    for (std::size_t i = 0; i < vertexCount; ++i) out[3 * i] = codec::reconstruct(values[i], scale);
  }
}

void Decoder::State::reconstructNormals() {
  if (!hasNormals) return computeVertexNormals(layout, positions.data(), normals.data());
  const std::int8_t* u = present.normals.data();
  for (std::size_t i = 0; i < vertexCount; ++i)
    decodeOctahedral({u[i], u[vertexCount + i]}, normals.data() + 3 * i);
}

std::unique_ptr<Decoder> Decoder::make(const StreamLayout& layout) {
  if (!isPossible(layout)) return nullptr;
  std::unique_ptr<State> state(new (std::nothrow) State);
  if (state == nullptr || !state->allocate(layout)) return nullptr;
  return std::unique_ptr<Decoder>(new (std::nothrow) Decoder(std::move(state)));
}

Decoder::Decoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Decoder::~Decoder() = default;

DecodeResult Decoder::decode(std::span<const std::byte> packet) {
  return state_->decode(packet);
}
std::uint64_t Decoder::tick() const {
  return state_->tick;
}
bool Decoder::hasFrame() const {
  return state_->hasFrame;
}

std::span<const float> Decoder::positions() const {
  return {state_->positions.data(), state_->positions.size()};
}

std::span<const float> Decoder::normals() const {
  State& s = *state_;
  if (s.hasFrame && !s.hasNormalFloats) s.reconstructNormals();
  s.hasNormalFloats = true;
  return {s.normals.data(), s.normals.size()};
}

std::uint64_t Decoder::reconstructionHash() const {
  State& s = *state_;
  if (s.hasFrame && !s.hasHash) {
    s.hash = hashFrame(s.vertexCount, s.present.positions.data(),
                       s.hasNormals ? s.present.normals.data() : nullptr);
  }
  s.hasHash = true;
  return s.hash;
}

}  // namespace clothstream::codec
