// SPDX-License-Identifier: MIT
// Normals beside codec 2's positions: what they are off those that follow from the positions.
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

// On the octahedron of which the top points where the normal about does: the seams are far away.
struct FacedNormal {
  Octahedral octahedral;
  // The axis that points up, 0 to 2, and 3 more where it points down.
  std::uint8_t top = 2;
};

FacedNormal faceNormal(const float* normal, std::uint8_t top);
// 3 floats, unit length.
void unfaceNormal(const FacedNormal& faced, float* normal);

// In integers: both ends find the same.
class NormalPrediction {
 public:
  // False if memory is out.
  [[nodiscard]] bool allocate(const StreamLayout& layout);
  // From the positions of the frame that is being made; by vertex.
  std::span<const FacedNormal> predict(const StreamLayout& layout, const Predictor& predictor);

 private:
  // Of the sum of the faces' normals; modulo 2^64.
  using Sum = std::array<std::uint64_t, 3>;
  using Place = std::array<std::int32_t, 3>;

  void addFace(const std::uint32_t* corners, std::size_t count);

  Array<Place> places_;
  Array<Sum> sums_;
  Array<FacedNormal> normals_;
};

// How large residuals along u or v are of late: which distribution the next one has.
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
