// SPDX-License-Identifier: MIT
// Vertices to packets on the CPU.
#include "proto/codec/encoder.h"

#include <array>
#include <cassert>
#include <utility>
#include <vector>

#include "proto/codec/lattice.h"
#include "proto/codec/octahedral.h"
#include "proto/codec/packet_writer.h"
#include "proto/codec/prediction.h"
#include "proto/codec/reconstruction_hash.h"
#include "proto/codec/residual_planes.h"

namespace clothstream::codec {
namespace {

// A frame's integers, channel after channel.
struct Integers {
  std::vector<std::int32_t> positions;
  std::vector<std::int8_t> normals;
};

}  // namespace

struct Encoder::State {
  explicit State(const StreamLayout& streamLayout)
      : layout(streamLayout),
        vertexCount(streamLayout.vertexCount()),
        scale(latticeScale(streamLayout.maxError)),
        writer(streamLayout) {
    const bool hasNormals = layout.normals == NormalMode::octahedral;
    for (Integers* integers : {&present, &reference}) {
      integers->positions.resize(positionPlaneBytes(vertexCount));
      integers->normals.resize(hasNormals ? normalPlaneBytes(vertexCount) : 0);
    }
    residuals.resize(vertexCount);
    normalResiduals.resize(hasNormals ? vertexCount : 0);
    for (auto& plane : planes) plane.resize(positionPlaneBytes(vertexCount));
    normalPlane.resize(hasNormals ? normalPlaneBytes(vertexCount) : 0);
  }

  void quantiseFrame(std::span<const float> positions, std::span<const float> normals) {
    for (std::size_t i = 0; i < vertexCount; ++i) {
      for (std::size_t c = 0; c < kPositionChannels; ++c) {
        present.positions[c * vertexCount + i] = quantise(positions[kPositionChannels * i + c], scale);
      }
    }
    if (present.normals.empty()) return;
    for (std::size_t i = 0; i < vertexCount; ++i) {
      const Octahedral octahedral = encodeOctahedral(&normals[3 * i]);
      present.normals[i] = octahedral.u;
      present.normals[vertexCount + i] = octahedral.v;
    }
  }

  template <typename T>
  Prediction choose(const std::vector<T>& values, const std::vector<T>& referenceValues,
                    bool predicted) const {
    PredictionCosts costs{};
    for (std::size_t start = 0; start < values.size(); start += vertexCount) {
      measure(layout, &values[start], predicted ? &referenceValues[start] : nullptr, costs);
    }
    return cheapest(costs, predicted);
  }

  StreamLayout layout;
  std::size_t vertexCount;
  LatticeScale scale;
  PacketWriter writer;
  Integers present, reference;
  std::vector<std::int32_t> residuals;
  std::vector<std::int8_t> normalResiduals;
  std::array<std::vector<std::byte>, kMaxPlanes> planes;
  std::vector<std::byte> normalPlane;
  std::uint64_t tick = 0;
  bool hasReference = false;
};

std::unique_ptr<Encoder> Encoder::make(const StreamLayout& layout) {
  if (!isPossible(layout)) return nullptr;
  return std::unique_ptr<Encoder>(new Encoder(std::make_unique<State>(layout)));
}

Encoder::Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Encoder::~Encoder() = default;

std::size_t Encoder::packetBound() const {
  return state_->writer.packetBound();
}

std::size_t Encoder::encode(std::uint64_t tick, PacketKind kind, std::span<const float> positions,
                            std::span<const float> normals, std::span<std::byte> out) {
  State& s = *state_;
  const std::size_t n = s.vertexCount;
  assert(positions.size() == kPositionChannels * n);
  assert(s.normalPlane.empty() || normals.size() == 3 * n);
  assert(!s.hasReference || tick > s.tick);
  std::swap(s.present, s.reference);
  s.quantiseFrame(positions, normals);

  const bool predicted = s.hasReference && kind == PacketKind::predicted;
  FrameResiduals frame;
  frame.kind = predicted ? PacketKind::predicted : PacketKind::key;
  frame.tick = tick;
  frame.referenceTick = s.tick;
  frame.positionPrediction = s.choose(s.present.positions, s.reference.positions, predicted);
  std::uint32_t bits = 0;
  for (std::size_t start = 0; start < s.present.positions.size(); start += n) {
    predict(s.layout, frame.positionPrediction, &s.present.positions[start], &s.reference.positions[start],
            s.residuals.data());
    bits |=
        splitPlanes(s.residuals.data(), n,
                    {s.planes[0].data(), s.planes[1].data(), s.planes[2].data(), s.planes[3].data()}, start);
  }
  frame.planeCount = planeCount(bits);
  for (std::size_t p = 0; p < frame.planeCount; ++p) frame.planes[p] = s.planes[p];
  if (!s.normalPlane.empty()) {
    frame.normalPrediction = s.choose(s.present.normals, s.reference.normals, predicted);
    for (std::size_t start = 0; start < s.present.normals.size(); start += n) {
      predict(s.layout, frame.normalPrediction, &s.present.normals[start], &s.reference.normals[start],
              s.normalResiduals.data());
      splitPlane(s.normalResiduals.data(), n, &s.normalPlane[start]);
    }
    frame.normalPlane = s.normalPlane;
  }
  s.tick = tick;
  s.hasReference = true;
  return s.writer.write(frame, out);
}

void Encoder::forgetHistory() {
  state_->hasReference = false;
}

std::uint64_t Encoder::reconstructionHash() const {
  const State& s = *state_;
  return hashFrame(s.vertexCount, s.present.positions.data(),
                   s.present.normals.empty() ? nullptr : s.present.normals.data());
}

}  // namespace clothstream::codec
