// SPDX-License-Identifier: MIT
// Vertices to packets: what all codecs have in common.
#include "proto/codec/encoder.h"

#include <cassert>
#include <utility>

#include "proto/codec/body.h"

namespace clothstream::codec {

struct Encoder::State {
  std::unique_ptr<BodyEncoder> body;
  std::size_t floats = 0;
  bool hasNormals = false;
  std::uint64_t tick = 0;
  bool hasReference = false;
};

std::unique_ptr<Encoder> Encoder::make(const StreamLayout& layout) {
  if (!isPossible(layout)) return nullptr;
  auto state = std::make_unique<State>();
  state->body =
      layout.codec == kCodecLatticeZstd ? makeLatticeEncoder(layout) : makeHierarchicalEncoder(layout);
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
  assert(!s.hasReference || tick > s.tick);
  assert(out.size() >= packetBound());
  const PacketKind possible = s.hasReference ? kind : PacketKind::key;
  const std::size_t bytes = s.body->encode(tick, possible, s.tick, positions, normals, out);
  s.tick = tick;
  s.hasReference = true;
  return bytes;
}

void Encoder::forgetHistory() {
  state_->hasReference = false;
}

std::uint64_t Encoder::reconstructionHash() const {
  return state_->body->reconstructionHash();
}

}  // namespace clothstream::codec
