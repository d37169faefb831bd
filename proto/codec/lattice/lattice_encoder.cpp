// SPDX-License-Identifier: MIT
// Codec 1: vertices to packets on the CPU.

#include <array>
#include <cassert>
#include <utility>
#include <vector>

#include "proto/codec/body.h"
#include "proto/codec/lattice/lattice.h"
#include "proto/codec/lattice/packet_writer.h"
#include "proto/codec/lattice/prediction.h"
#include "proto/codec/lattice/residual_planes.h"
#include "proto/codec/octahedral.h"
#include "proto/codec/reconstruction_hash.h"

namespace clothstream::codec {
namespace {

// A frame's integers, channel after channel.
struct Integers {
  std::vector<std::int32_t> positions;
  std::vector<std::int8_t> normals;
};

class LatticeEncoder final : public BodyEncoder {
 public:
  explicit LatticeEncoder(const StreamLayout& streamLayout)
      : layout_(streamLayout),
        vertexCount_(streamLayout.vertexCount()),
        scale_(latticeScale(streamLayout.maxError)),
        writer_(streamLayout) {
    const bool hasNormals = layout_.normals == NormalMode::octahedral;
    for (Integers* integers : {&present_, &reference_}) {
      integers->positions.resize(positionPlaneBytes(vertexCount_));
      integers->normals.resize(hasNormals ? normalPlaneBytes(vertexCount_) : 0);
    }
    residuals_.resize(vertexCount_);
    normalResiduals_.resize(hasNormals ? vertexCount_ : 0);
    for (auto& plane : planes_) plane.resize(positionPlaneBytes(vertexCount_));
    normalPlane_.resize(hasNormals ? normalPlaneBytes(vertexCount_) : 0);
  }

  std::size_t packetBound() const override { return writer_.packetBound(); }
  std::size_t encode(const FrameRole& role, std::span<const float> positions, std::span<const float> normals,
                     std::span<std::byte> out) override;
  std::uint64_t reconstructionHash() const override {
    return hashFrame(vertexCount_, present_.positions.data(),
                     present_.normals.empty() ? nullptr : present_.normals.data());
  }

 private:
  void quantiseFrame(std::span<const float> positions, std::span<const float> normals) {
    for (std::size_t i = 0; i < vertexCount_; ++i) {
      for (std::size_t c = 0; c < kPositionChannels; ++c) {
        present_.positions[c * vertexCount_ + i] = quantise(positions[kPositionChannels * i + c], scale_);
      }
    }
    if (present_.normals.empty()) return;
    for (std::size_t i = 0; i < vertexCount_; ++i) {
      const Octahedral octahedral = encodeOctahedral(&normals[3 * i]);
      present_.normals[i] = octahedral.u;
      present_.normals[vertexCount_ + i] = octahedral.v;
    }
  }

  template <typename T>
  Prediction choose(const std::vector<T>& values, const std::vector<T>& referenceValues,
                    bool predicted) const {
    PredictionCosts costs{};
    for (std::size_t start = 0; start < values.size(); start += vertexCount_) {
      measure(layout_, &values[start], predicted ? &referenceValues[start] : nullptr, costs);
    }
    return cheapest(costs, predicted);
  }

  StreamLayout layout_;
  std::size_t vertexCount_;
  LatticeScale scale_;
  PacketWriter writer_;
  Integers present_, reference_;
  std::vector<std::int32_t> residuals_;
  std::vector<std::int8_t> normalResiduals_;
  std::array<std::vector<std::byte>, kMaxPlanes> planes_;
  std::vector<std::byte> normalPlane_;
};

std::size_t LatticeEncoder::encode(const FrameRole& role, std::span<const float> positions,
                                   std::span<const float> normals, std::span<std::byte> out) {
  const std::size_t n = vertexCount_;
  std::swap(present_, reference_);
  quantiseFrame(positions, normals);

  const bool predicted = role.kind == PacketKind::predicted;
  FrameResiduals frame;
  frame.kind = role.kind;
  frame.tick = role.tick;
  frame.referenceTick = role.referenceTick;
  frame.positionPrediction = choose(present_.positions, reference_.positions, predicted);
  std::uint32_t bits = 0;
  for (std::size_t start = 0; start < present_.positions.size(); start += n) {
    predict(layout_, frame.positionPrediction, &present_.positions[start], &reference_.positions[start],
            residuals_.data());
    bits |= splitPlanes(residuals_.data(), n,
                        {planes_[0].data(), planes_[1].data(), planes_[2].data(), planes_[3].data()}, start);
  }
  frame.planeCount = planeCount(bits);
  for (std::size_t p = 0; p < frame.planeCount; ++p) frame.planes[p] = planes_[p];
  if (!normalPlane_.empty()) {
    frame.normalPrediction = choose(present_.normals, reference_.normals, predicted);
    for (std::size_t start = 0; start < present_.normals.size(); start += n) {
      predict(layout_, frame.normalPrediction, &present_.normals[start], &reference_.normals[start],
              normalResiduals_.data());
      splitPlane(normalResiduals_.data(), n, &normalPlane_[start]);
    }
    frame.normalPlane = normalPlane_;
  }
  return writer_.write(frame, out);
}

}  // namespace

std::unique_ptr<BodyEncoder> makeLatticeEncoder(const StreamLayout& layout) {
  return std::make_unique<LatticeEncoder>(layout);
}

}  // namespace clothstream::codec
