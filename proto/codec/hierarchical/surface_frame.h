// SPDX-License-Identifier: MIT
// Surface frames: two directions along a surface and its normal, in integers.
#pragma once

#include <array>
#include <cstdint>

#include "proto/codec/hierarchical/simd.h"

namespace clothstream::codec::hierarchical {

inline constexpr int kUnitBits = 14;  // maximum component of a unit vector is 2^kUnitBits

// Three orthogonal unit vectors u, v and n, accurate to about 2^-13.
struct SurfaceFrame {
  Int16x8 tangents;  // ux uy uz 0 vx vy vz 0
  Int16x8 normal;    // nx ny nz 0 0 0 0 0

  // u a + v b + n c in the lanes x, y, z. All pairs of `along` are a b, all pairs of `across` are c 0.
  Int32x4 combine(Int16x8 along, Int16x8 across) const {
    return dotPairs(interleaveHalves(tangents), along) +
           dotPairs(interleave(normal, Int16x8::zero()), across);
  }
  // Products of the vector x y z 0 x y z 0 with u, v and n, in units of 2^-kUnitBits. The fourth lane is 0.
  Int32x4 project(Int16x8 vector) const {
    return addNeighbours(dotPairs(vector, tangents), dotPairs(vector, normal));
  }
};

// Surface frames of four vertices.
struct SurfaceFrames {
  Vectors4 u, v, n;

  std::array<SurfaceFrame, 4> split() const {
    const auto xyz = [](const Vectors4& a) {
      const Int16x8 xy = pairs(a.x, a.y), z = pairs(a.z);
      return std::array{interleave32Low(xy, z), interleave32High(xy, z)};
    };
    const auto us = xyz(u), vs = xyz(v), ns = xyz(n);
    const Int16x8 zero = Int16x8::zero();
    std::array<SurfaceFrame, 4> frames;
    for (std::size_t i = 0; i < 2; ++i) {
      frames[2 * i] = {interleave64Low(us[i], vs[i]), interleave64Low(ns[i], zero)};
      frames[2 * i + 1] = {interleave64High(us[i], vs[i]), interleave64High(ns[i], zero)};
    }
    return frames;
  }
};

namespace detail {

// 2^28 / sqrt(n), accurate to about 2^-12, for n from 2^26 to below 2^28. The index is the twelve highest of
// n's 28 bits; the entry is for the middle of the range.
extern const std::array<std::uint16_t, 4096> kRoots;

// Scales the largest component to 13 bits, so that the squared length has fewer than 28 bits. Returns all
// bits for a zero vector. Components are below 2^30.
inline Int32x8 scale(Vectors8& a) {
  const Int32x8 all = a.x.magnitude() | a.y.magnitude() | a.z.magnitude();
  // Clears the lower of two adjacent ones, so that the float is not rounded up to the next power of two.
  const Int32x8 exponent =
      Float32x8::of(Int32x8::without(all.shiftedRight(1), all)).bits().bitsShiftedRight(23);
  const Float32x8 factor = Float32x8::ofBits((Int32x8::all(266) - exponent).shiftedLeft(23));
  // Bits that the shift removes and that a float has no room for.
  const Int32x8 lost = (all > Int32x8::all((1 << 18) - 1)) & Int32x8::all(31);
  const auto floor = [&](Int32x8 value) {
    const Float32x8 scaled = Float32x8::of(Int32x8::without(lost, value)) * factor;
    const Int32x8 truncated = scaled.truncated();
    return truncated + (Float32x8::of(truncated) > scaled);
  };
  a = {floor(a.x), floor(a.y), floor(a.z)};
  return all == Int32x8::all(0);
}

inline Int32x4 rootsAt(Int32x4 places) {
  alignas(16) std::int32_t at[4];
  places.store(at);
  return Int32x4::of(kRoots[static_cast<std::size_t>(at[0])], kRoots[static_cast<std::size_t>(at[1])],
                     kRoots[static_cast<std::size_t>(at[2])], kRoots[static_cast<std::size_t>(at[3])]);
}
inline Int32x8 rootsAt(const Int32x8& places) {
  return {rootsAt(places.first), rootsAt(places.second)};
}

// Scales to unit length; `a` is already scaled by scale().
inline Vectors8 normalised(const Vectors8& a) {
  const auto xy = pairs(a.x, a.y), z = pairs(a.z);
  Int32x8 squared = dotPairs(xy, xy) + dotPairs(z, z);
  // The table starts at 2^26.
  const Int32x8 isLow = Int32x8::all(1 << 26) > squared;
  squared = select(isLow, squared.shiftedLeft(2), squared);
  const auto root = asHalves(rootsAt(squared.shiftedRight(16) & Int32x8::all(4095)));  // valid for any `a`
  const auto times = [&](Int32x8 value) {
    const Int32x8 product = dotPairs(asHalves(value), root);
    return (product + (product & isLow) + Int32x8::all(1 << 13)).shiftedRight(14);
  };
  return {times(a.x), times(a.y), times(a.z)};
}

// Components fit 16 bits.
inline Vectors8 cross(const Vectors8& a, const Vectors8& b) {
  const auto x = pairs(b.x), y = pairs(b.y), z = pairs(b.z);
  const auto times = [](Int32x8 value, const auto& other) { return dotPairs(asHalves(value), other); };
  return {times(a.y, z) - times(a.z, y), times(a.z, x) - times(a.x, z), times(a.x, y) - times(a.y, x)};
}

}  // namespace detail

// u lies along `first` and n is orthogonal to both. If they span no plane, the axes are x, y, z.
inline std::array<SurfaceFrames, 2> surfaceFrames(Vectors8 first, Vectors8 second) {
  constexpr std::int32_t kOne = 1 << kUnitBits;
  Int32x8 isNoPlane = detail::scale(first) | detail::scale(second);
  Vectors8 u = detail::normalised(first), n = detail::cross(u, second);
  isNoPlane = isNoPlane | detail::scale(n);
  n = detail::normalised(n);
  Vectors8 v = detail::cross(n, u);
  const auto rounded = [](Int32x8 a) { return (a + Int32x8::all(kOne / 2)).shiftedRight(kUnitBits); };
  v = {rounded(v.x), rounded(v.y), rounded(v.z)};
  const Int32x8 one = isNoPlane & Int32x8::all(kOne);
  const auto or0 = [&](Int32x8 a) { return Int32x8::without(isNoPlane, a); };
  u = {or0(u.x) | one, or0(u.y), or0(u.z)};
  v = {or0(v.x), or0(v.y) | one, or0(v.z)};
  n = {or0(n.x), or0(n.y), or0(n.z) | one};
  return {{{firstOf(u), firstOf(v), firstOf(n)}, {secondOf(u), secondOf(v), secondOf(n)}}};
}

}  // namespace clothstream::codec::hierarchical
