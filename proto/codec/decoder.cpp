// SPDX-License-Identifier: MIT
// Decoder: checks of a packet's header, and results that are computed on demand.
#include "proto/codec/decoder.h"

#include <new>
#include <optional>
#include <utility>

#include "proto/codec/array.h"
#include "proto/codec/hierarchical/hierarchical_decoder.h"
#include "proto/codec/vertex_normals.h"

namespace clothstream::codec {

struct Decoder::State {
  bool allocate(const StreamLayout& streamLayout, Detail detail) {
    layout = streamLayout;
    // Sent normals predict one another, so those of the coarse vertices alone cannot be decoded.
    sendsNormals = layout.normals == NormalMode::octahedral && detail == Detail::full;
    const std::size_t floats = 3 * std::size_t{layout.vertexCount()};
    return body.allocate(layout, detail) && positions.allocate(floats) && normals.allocate(floats);
  }

  DecodeResult decode(std::span<const std::byte> bytes) {
    const std::optional<ParsedPacket> packet = parsePacket(bytes);
    if (!packet || packet->header.codec != layout.codec) return DecodeResult::malformed;
    const PacketHeader& header = packet->header;
    if (header.epoch != layout.epoch) return DecodeResult::wrongEpoch;
    if (hasFrame && header.tick <= tick) return DecodeResult::stale;
    // Packets cover all cloths and refer to one frame.
    const ClothRange& range = header.ranges[0];
    if (header.rangeCount != 1 || range.first != 0 || range.count != layout.cloths.size())
      return DecodeResult::malformed;
    if (header.referenceCount > 1) return DecodeResult::malformed;
    const bool key = header.kind == PacketKind::key;
    if (header.quality >= layout.qualities) return DecodeResult::malformed;
    if (!key) {
      if (!hasFrame || header.references[0] != tick) return DecodeResult::missingReference;
      if (header.quality != quality) return DecodeResult::malformed;
    }
    if (!body.decode(*packet)) return DecodeResult::malformed;
    tick = header.tick;
    quality = header.quality;
    hasFrame = true;
    hasHash = hasNormals = false;
    body.writePositions(positions.data());
    return DecodeResult::ok;
  }

  void makeNormals() {
    if (sendsNormals) return body.writeNormals(normals.data());
    computeVertexNormals(layout, positions.data(), normals.data());
  }

  StreamLayout layout;
  hierarchical::HierarchicalDecoder body;
  bool sendsNormals = false;
  Array<float> positions, normals;
  std::uint64_t tick = 0;
  std::uint8_t quality = 0;
  std::uint64_t hash = 0;
  bool hasFrame = false;
  // Results for the newest frame, computed when they are first requested.
  bool hasHash = false, hasNormals = false;
};

std::unique_ptr<Decoder> Decoder::make(const StreamLayout& layout, Detail detail) {
  if (!isPossible(layout)) return nullptr;
  std::unique_ptr<State> state(new (std::nothrow) State);
  if (state == nullptr || !state->allocate(layout, detail)) return nullptr;
  return std::unique_ptr<Decoder>(new (std::nothrow) Decoder(std::move(state)));
}

Decoder::Decoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Decoder::~Decoder() = default;

DecodeResult Decoder::decode(std::span<const std::byte> packet) {
  return state_->decode(packet);
}
void Decoder::restart() {
  state_->hasFrame = false;
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
  if (s.hasFrame && !s.hasNormals) s.makeNormals();
  s.hasNormals = true;
  return {s.normals.data(), s.normals.size()};
}

std::uint64_t Decoder::reconstructionHash() const {
  State& s = *state_;
  if (s.hasFrame && !s.hasHash) s.hash = s.body.reconstructionHash();
  s.hasHash = true;
  return s.hash;
}

}  // namespace clothstream::codec
