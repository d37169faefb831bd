// SPDX-License-Identifier: MIT
// Prediction of sent normals: their difference from the normals that follow from the decoded positions.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "proto/codec/array.h"
#include "proto/codec/hierarchical/predictor.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/octahedral.h"

namespace clothstream::codec::hierarchical {

// A normal on an octahedron whose top points roughly along the normal, so that its seams are far away.
struct FacedNormal {
  Octahedral octahedral;
  // Axis of the top, 0 to 2; plus 3 if the top points in the negative direction.
  std::uint8_t top = 2;
};

FacedNormal faceNormal(const float* normal, std::uint8_t top);
// Writes 3 floats of unit length.
void unfaceNormal(const FacedNormal& faced, float* normal);

// Computes in integers, so both ends find the same.
class NormalPrediction {
 public:
  // False if memory is out.
  [[nodiscard]] bool allocate(const StreamLayout& layout);
  // Predicts from the positions of the frame that is being coded. The result is indexed by vertex.
  std::span<const FacedNormal> predict(const StreamLayout& layout, const Predictor& predictor);

 private:
  // Sum of the faces' normals, modulo 2^64.
  using Sum = std::array<std::uint64_t, 3>;
  using Place = std::array<std::int32_t, 3>;

  void addFace(const std::uint32_t* corners, std::size_t count);

  Array<Place> places_;
  Array<Sum> sums_;
  Array<FacedNormal> normals_;
};

// Recent magnitude of the residuals along u or v. It selects the distribution of the next residual.
class NormalScale {
 public:
  std::uint32_t scale() const { return scaleOf(expected_); }
  void add(std::int32_t residual) {
    constexpr auto kMost = static_cast<std::int32_t>(kMaxMagnitude);
    expected_ += (256 * std::abs(std::clamp(residual, -kMost, kMost)) - expected_) >> 5;
  }

 private:
  std::int32_t expected_ = 256;  // in 1/256 of a step
};

}  // namespace clothstream::codec::hierarchical
