// SPDX-License-Identifier: MIT
// Encoder: kinds and references of frames.
#include "proto/codec/encoder.h"

#include <cassert>
#include <utility>

#include "proto/codec/hierarchical/hierarchical_encoder.h"

namespace clothstream::codec {

struct Encoder::State {
  std::unique_ptr<hierarchical::HierarchicalEncoder> body;
  std::size_t floats = 0;
  bool hasNormals = false;
  std::uint8_t quality = 0;
  FrameRole newest;
  bool hasHistory = false;  // the next frame can refer to `newest`
};

std::unique_ptr<Encoder> Encoder::make(const StreamLayout& stream, const EncoderOptions& options) {
  if (!isPossible(stream) || options.quality >= stream.qualities) return nullptr;
  StreamLayout layout = stream;
  layout.maxError = maxErrorOf(stream, options.quality);
  auto state = std::make_unique<State>();
  state->quality = options.quality;
  state->body = std::make_unique<hierarchical::HierarchicalEncoder>(layout, options);
  state->floats = 3 * std::size_t{layout.vertexCount()};
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
  assert(!s.hasHistory || tick > s.newest.tick);
  assert(out.size() >= packetBound());
  FrameRole role{.tick = tick, .quality = s.quality};
  if (kind == PacketKind::predicted && s.hasHistory) {
    role.kind = PacketKind::predicted;
    role.referenceTick = s.newest.tick;
  }
  const std::size_t bytes = s.body->encode(role, positions, normals, out);
  s.newest = role;
  s.hasHistory = true;
  return bytes;
}

void Encoder::forgetHistory() {
  state_->hasHistory = false;
}

PacketKind Encoder::kind() const {
  return state_->newest.kind;
}

std::uint64_t Encoder::referenceTick() const {
  return state_->newest.referenceTick;
}

std::uint64_t Encoder::reconstructionHash() const {
  return state_->body->reconstructionHash();
}

}  // namespace clothstream::codec
