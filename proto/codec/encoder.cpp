// SPDX-License-Identifier: MIT
// Encoder: frame numbers, layers and references.
#include "proto/codec/encoder.h"

#include <cassert>
#include <utility>

#include "proto/codec/hierarchical/hierarchical_encoder.h"
#include "proto/codec/temporal_layers.h"

namespace clothstream::codec {

struct Encoder::State {
  std::unique_ptr<hierarchical::HierarchicalEncoder> body;
  std::size_t floats = 0;
  bool hasNormals = false;
  std::uint8_t layers = 1, quality = 0;
  HeldFrames held;
  FrameRole newest;
  std::uint64_t frame = 0;  // number of the next frame since the key frame; 0 is a key frame
};

std::unique_ptr<Encoder> Encoder::make(const StreamLayout& stream, const EncoderOptions& options) {
  if (!isPossible(stream) || options.quality >= stream.qualities) return nullptr;
  StreamLayout layout = stream;
  layout.maxError = maxErrorOf(stream, options.quality);
  assert(options.weightLag == 0 || layout.temporalLayers == 1);
  auto state = std::make_unique<State>();
  state->quality = options.quality;
  state->body = std::make_unique<hierarchical::HierarchicalEncoder>(layout, options);
  state->floats = 3 * std::size_t{layout.vertexCount()};
  state->layers = layout.temporalLayers;
  state->hasNormals = layout.normals == NormalMode::octahedral;
  return std::unique_ptr<Encoder>(new Encoder(std::move(state)));
}

Encoder::Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Encoder::~Encoder() = default;

std::size_t Encoder::packetBound() const {
  return state_->body->packetBound();
}

std::size_t Encoder::encode(std::uint64_t tick, PacketKind kind, std::span<const float> positions,
                            std::span<const float> normals, std::span<std::byte> out) {
  State& s = *state_;
  assert(positions.size() == s.floats);
  assert(!s.hasNormals || normals.size() == s.floats);
  assert(s.frame == 0 || tick > s.newest.tick);
  assert(out.size() >= packetBound());
  FrameRole role{.tick = tick, .quality = s.quality};
  if (kind == PacketKind::key || s.frame == 0) {
    s.frame = 0;
    s.held.clear();
  } else {
    role.kind = PacketKind::predicted;
    role.layer = layerOf(s.frame, s.layers);
    role.referenceLayer = s.held.referenceOf(role.layer);
    role.referenceTick = *s.held.tick(role.referenceLayer);
  }
  const std::size_t bytes = s.body->encode(role, positions, normals, out);
  s.held.hold(role.layer, tick);
  s.newest = role;
  s.frame += 1;
  return bytes;
}

void Encoder::forgetHistory() {
  state_->frame = 0;
}

PacketKind Encoder::kind() const {
  return state_->newest.kind;
}

std::uint8_t Encoder::layer() const {
  return state_->newest.layer;
}

std::uint64_t Encoder::referenceTick() const {
  return state_->newest.referenceTick;
}

std::uint64_t Encoder::reconstructionHash() const {
  return state_->body->reconstructionHash();
}

}  // namespace clothstream::codec
