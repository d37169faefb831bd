// SPDX-License-Identifier: MIT
// Positions on a lattice of integers: what is coded instead of floats. The kernels do the same operations.
#pragma once

#include <cmath>
#include <cstdint>

namespace clothstream::codec {

// Lattice coordinates lie within +-kLatticeLimit; what lies beyond is moved to it.
inline constexpr std::int32_t kLatticeLimit = 1 << 23;

struct LatticeScale {
  float step;         // m
  float inverseStep;  // nearest float to 1/step
};

// The step that keeps `maxError` (kSmallestMaxError to kLargestMaxError): the largest float not above
// 2 maxError - 2^-18.
//
// Why that keeps it within 32 m: let y = fl(q step) be what a decoder gives for q, and u = 2^-19 the spacing
// of floats just below 32 m. y is at most u/2 from q step. quantise() ends in one of two ways: |x - y| <=
// step/2 as tested (the difference of two such near floats is exact); or q was moved by one after |x - y| >
// step/2, and then the new y is at most step/2 + u from x, since either y is u/2 off. So |x - y| <= step/2 +
// 2^-19 <= maxError. The first guess of q is at most 3 * 2^-24 |q| + 1/2 < 3/2 from x/step, so that one move
// is enough up to |q| = 2^24 / 3.
LatticeScale latticeScale(float maxError);

// Multiply, add, floor, compare: each correctly rounded, on the CPU as on every Vulkan device.
inline std::int32_t quantise(float x, LatticeScale scale) {
  constexpr float limit = static_cast<float>(kLatticeLimit);
  float q = std::floor(x * scale.inverseStep + 0.5f);
  const float half = scale.step * 0.5f;
  const float error = x - q * scale.step;
  if (error > half) q = q + 1.0f;
  if (error < -half) q = q - 1.0f;
  if (!(q >= -limit)) q = -limit;
  if (q > limit) q = limit;
  return static_cast<std::int32_t>(q);
}

inline float reconstruct(std::int32_t q, LatticeScale scale) {
  return static_cast<float>(q) * scale.step;
}

}  // namespace clothstream::codec
