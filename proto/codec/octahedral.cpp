// SPDX-License-Identifier: MIT
// Unit normals as two signed bytes on the unfolded octahedron.
#include "proto/codec/octahedral.h"

#include <cmath>
#include <cstdlib>

namespace clothstream::codec {
namespace {

constexpr std::int32_t kOne = 1 << 15;

std::int32_t fixedPoint(float x) {
  float q = std::floor(x * static_cast<float>(kOne) + 0.5f);
  if (!(q >= static_cast<float>(-kOne))) q = static_cast<float>(-kOne);
  if (q > static_cast<float>(kOne)) q = static_cast<float>(kOne);
  return static_cast<std::int32_t>(q);
}

// kOctahedralLimit * magnitude / sum, rounded to nearest, with the sign of `signedBy`. Integer division is
// exact on every machine; a float reciprocal is not.
std::int8_t component(std::int32_t magnitude, std::int32_t sum, std::int32_t signedBy) {
  const std::int32_t rounded = (2 * kOctahedralLimit * magnitude + sum) / (2 * sum);
  return static_cast<std::int8_t>(signedBy < 0 ? -rounded : rounded);
}

}  // namespace

Octahedral encodeOctahedral(const float* normal) {
  return encodeOctahedral(fixedPoint(normal[0]), fixedPoint(normal[1]), fixedPoint(normal[2]));
}

Octahedral encodeOctahedral(std::int32_t x, std::int32_t y, std::int32_t z) {
  const std::int32_t sum = std::abs(x) + std::abs(y) + std::abs(z);
  if (sum == 0) return {};
  if (z < 0) return {component(sum - std::abs(y), sum, x), component(sum - std::abs(x), sum, y)};
  return {component(std::abs(x), sum, x), component(std::abs(y), sum, y)};
}

void decodeOctahedral(Octahedral octahedral, float* normal) {
  constexpr float scale = 1.0f / static_cast<float>(kOctahedralLimit);
  float x = static_cast<float>(octahedral.u) * scale, y = static_cast<float>(octahedral.v) * scale;
  const float z = 1.0f - std::fabs(x) - std::fabs(y);
  if (z < 0) {
    const float foldedX = std::copysign(1.0f - std::fabs(y), x),
                foldedY = std::copysign(1.0f - std::fabs(x), y);
    x = foldedX;
    y = foldedY;
  }
  const float inverseLength = 1.0f / std::sqrt(x * x + y * y + z * z);
  normal[0] = x * inverseLength;
  normal[1] = y * inverseLength;
  normal[2] = z * inverseLength;
}

}  // namespace clothstream::codec
