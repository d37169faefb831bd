// SPDX-License-Identifier: MIT
// Two directions along a surface and its normal, in integers alone.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "proto/codec/hierarchical/lanes.h"

namespace clothstream::codec::hierarchical {

inline constexpr int kUnitBits = 14;  // a component of a unit vector is 2^kUnitBits at most

// Three orthogonal unit vectors u, v and n, to about 2^-13.
struct SurfaceFrame {
  Int16x8 tangents;  // ux uy uz 0 vx vy vz 0
  Int16x8 normal;    // nx ny nz 0 0 0 0 0

  // u a + v b + n c, of which the lanes are x, y, z: `along` has a b in all pairs, `across` c 0.
  Int32x4 combine(Int16x8 along, Int16x8 across) const {
    return dotPairs(interleaveHalves(tangents), along) +
           dotPairs(interleave(normal, Int16x8::zero()), across);
  }
  // The products with u, v and n of what has x y z 0 x y z 0, in units of 2^-kUnitBits; the fourth lane 0.
  Int32x4 project(Int16x8 vector) const {
    return addNeighbours(dotPairs(vector, tangents), dotPairs(vector, normal));
  }
};

namespace detail {

struct Vec3 {
  std::int32_t x, y, z;
};

// 2^28 / sqrt(n) for the n from 2^26 to below 2^28 that have these twelve highest of 28 bits, in their
// middle: to about 2^-12.
extern const std::array<std::uint16_t, 4096> kRoots;

inline std::uint32_t magnitude(std::int32_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return value < 0 ? 0u - bits : bits;
}

// The largest component to 13 bits, so that the squared length has less than 28. False for zero.
inline bool scale(Vec3& v) {
  const std::uint32_t all = magnitude(v.x) | magnitude(v.y) | magnitude(v.z);
  const int surplus = static_cast<int>(std::bit_width(all)) - 13;
  if (surplus > 0) {
    v = {v.x >> surplus, v.y >> surplus, v.z >> surplus};
  } else {
    v = {v.x * (1 << -surplus), v.y * (1 << -surplus), v.z * (1 << -surplus)};
  }
  return all != 0;
}

// To unit length; `v` is scaled and not zero.
inline Vec3 normalised(const Vec3& v) {
  const auto squared = static_cast<std::uint32_t>(v.x * v.x + v.y * v.y + v.z * v.z);
  // An even shift brings it to at least 2^26, where the table starts.
  const int shift = (28 - static_cast<int>(std::bit_width(squared))) & ~1;
  const std::int32_t root = kRoots[(squared << shift) >> 16];
  const int down = 14 - shift / 2;
  const std::int32_t half = 1 << (down - 1);
  return {(v.x * root + half) >> down, (v.y * root + half) >> down, (v.z * root + half) >> down};
}

inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline std::int32_t pair(std::int32_t low, std::int32_t high) {
  return static_cast<std::int32_t>((static_cast<std::uint32_t>(low) & 0xffffu) |
                                   static_cast<std::uint32_t>(high) << 16);
}

inline Vec3 load(Int32x4 lanes) {
  alignas(16) std::int32_t v[4];
  lanes.store(v);
  return {v[0], v[1], v[2]};
}

}  // namespace detail

// u along `first`, n across both; the axes x, y, z where the two span no plane. The fourth lanes are ignored.
inline SurfaceFrame surfaceFrame(Int32x4 first, Int32x4 second) {
  using namespace detail;
  constexpr std::int32_t kOne = 1 << kUnitBits;
  Vec3 u = load(first), across = load(second), v{0, kOne, 0}, n{0, 0, kOne};
  bool spansPlane = scale(u) && scale(across);
  if (spansPlane) {
    u = normalised(u);
    n = cross(u, across);
    spansPlane = scale(n);
  }
  if (spansPlane) {
    n = normalised(n);
    v = cross(n, u);
    constexpr std::int32_t half = kOne / 2;
    v = {(v.x + half) >> kUnitBits, (v.y + half) >> kUnitBits, (v.z + half) >> kUnitBits};
  } else {
    u = {kOne, 0, 0};
    n = {0, 0, kOne};
  }
  return {Int16x8{Int32x4::of(pair(u.x, u.y), pair(u.z, 0), pair(v.x, v.y), pair(v.z, 0)).v},
          Int16x8{Int32x4::of(pair(n.x, n.y), pair(n.z, 0), 0, 0).v}};
}

}  // namespace clothstream::codec::hierarchical
