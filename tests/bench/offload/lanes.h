// SPDX-License-Identifier: MIT
// Four floats as one vector of WebAssembly's SIMD.
#pragma once

#include <wasm_simd128.h>

namespace clothstream::bench::offload {

using Lanes = float __attribute__((vector_size(16)));
using Mask = int __attribute__((vector_size(16)));  // per lane all bits set or none

inline Lanes load(const float* from) {
  return static_cast<Lanes>(wasm_v128_load(from));
}
inline void store(float* to, Lanes value) {
  wasm_v128_store(to, static_cast<v128_t>(value));
}
inline Lanes splat(float value) {
  return Lanes{value, value, value, value};
}
inline Lanes select(Mask mask, Lanes a, Lanes b) {
  return static_cast<Lanes>(
      wasm_v128_bitselect(static_cast<v128_t>(a), static_cast<v128_t>(b), static_cast<v128_t>(mask)));
}
// `value` where the mask is set, else 0.
inline Lanes keep(Mask mask, Lanes value) {
  return static_cast<Lanes>(static_cast<Mask>(value) & mask);
}
inline bool any(Mask mask) {
  return wasm_v128_any_true(static_cast<v128_t>(mask));
}
// The smaller or larger of each lane, for lanes that are not NaN: one instruction on x86.
inline Lanes smaller(Lanes a, Lanes b) {
  return static_cast<Lanes>(wasm_f32x4_pmin(static_cast<v128_t>(a), static_cast<v128_t>(b)));
}
inline Lanes larger(Lanes a, Lanes b) {
  return static_cast<Lanes>(wasm_f32x4_pmax(static_cast<v128_t>(a), static_cast<v128_t>(b)));
}
inline Lanes squareRoot(Lanes value) {
  return static_cast<Lanes>(wasm_f32x4_sqrt(static_cast<v128_t>(value)));
}

// The vector that starts one or two lanes earlier in memory: `before` is the vector in front of `here`.
inline Lanes oneEarlier(Lanes before, Lanes here) {
  return __builtin_shufflevector(before, here, 3, 4, 5, 6);
}
inline Lanes twoEarlier(Lanes before, Lanes here) {
  return __builtin_shufflevector(before, here, 2, 3, 4, 5);
}

struct Triple {
  Lanes x, y, z;
};

inline Triple operator+(const Triple& a, const Triple& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Triple operator-(const Triple& a, const Triple& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Triple operator*(Lanes scale, const Triple& a) {
  return {scale * a.x, scale * a.y, scale * a.z};
}
inline Lanes dot(const Triple& a, const Triple& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Triple cross(const Triple& a, const Triple& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Triple keep(Mask mask, const Triple& a) {
  return {keep(mask, a.x), keep(mask, a.y), keep(mask, a.z)};
}
inline Triple select(Mask mask, const Triple& a, const Triple& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
inline Triple oneEarlier(const Triple& before, const Triple& here) {
  return {oneEarlier(before.x, here.x), oneEarlier(before.y, here.y), oneEarlier(before.z, here.z)};
}
inline Triple twoEarlier(const Triple& before, const Triple& here) {
  return {twoEarlier(before.x, here.x), twoEarlier(before.y, here.y), twoEarlier(before.z, here.z)};
}

}  // namespace clothstream::bench::offload
