// SPDX-License-Identifier: MIT
// Two directions along a surface and its normal.
#include "proto/codec/hierarchical/surface_frame.h"

#include <array>
#include <bit>

namespace clothstream::codec::hierarchical {
namespace {

struct Vec3 {
  std::int32_t x, y, z;
};

// 2^28 / sqrt(n) for the n that have these eight highest of 28 bits, in the middle of them.
constexpr std::array<std::uint16_t, 256> makeRoots() {
  std::array<std::uint16_t, 256> roots{};
  for (std::uint64_t i = 64; i < 256; ++i) {
    // 2^28 / sqrt((i + 1/2) 2^20) = 2^18 / sqrt(i + 1/2): r^2 (2 i + 1) <= 2^37.
    std::uint64_t root = 0;
    for (std::uint64_t bit = 1 << 15; bit != 0; bit >>= 1) {
      if ((root | bit) * (root | bit) * (2 * i + 1) <= std::uint64_t{1} << 37) root |= bit;
    }
    roots[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(root);
  }
  return roots;
}
constexpr std::array<std::uint16_t, 256> kRoots = makeRoots();

// 2^28 / sqrt(n) for n from 2^26 to below 2^28, to about 2^-14: one step of Newton's iteration.
std::int32_t reciprocalSquareRoot(std::uint32_t n) {
  const std::uint64_t root = kRoots[n >> 20];
  const std::uint64_t three = std::uint64_t{3} << 56;
  return static_cast<std::int32_t>(((three - n * root * root) >> 29) * root >> 28);
}

std::uint32_t magnitude(std::int32_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return value < 0 ? 0u - bits : bits;
}

// The largest component to 13 bits, so that the squared length has less than 28. False for zero.
bool scale(Vec3& v) {
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
Vec3 normalised(const Vec3& v) {
  const auto squared = static_cast<std::uint32_t>(v.x * v.x + v.y * v.y + v.z * v.z);
  // An even shift brings it to at least 2^26.
  const int shift = (28 - static_cast<int>(std::bit_width(squared))) & ~1;
  const std::int32_t root = reciprocalSquareRoot(squared << shift);
  const int down = 14 - shift / 2;
  const std::int32_t half = 1 << (down - 1);
  return {(v.x * root + half) >> down, (v.y * root + half) >> down, (v.z * root + half) >> down};
}

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

std::int32_t pair(std::int32_t low, std::int32_t high) {
  return static_cast<std::int32_t>((static_cast<std::uint32_t>(low) & 0xffffu) |
                                   static_cast<std::uint32_t>(high) << 16);
}

Vec3 load(Int32x4 lanes) {
  alignas(16) std::int32_t v[4];
  lanes.store(v);
  return {v[0], v[1], v[2]};
}

}  // namespace

SurfaceFrame surfaceFrame(Int32x4 first, Int32x4 second) {
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
