// SPDX-License-Identifier: MIT
// Vectors of 128 bits for SSE2, NEON and WebAssembly, from one source (SIMDe).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#ifdef __wasm__
#define SIMDE_FLOAT16_API 1  // no _Float16, which clang refuses for WebAssembly
#endif
#include <simde/x86/sse4.1.h>

namespace clothstream::codec::hierarchical {

// SIMDe writes these lane by lane for WebAssembly, which has an instruction for each.
#ifdef __wasm_simd128__
inline int highestBitsOf8(simde__m128i v) {
  return static_cast<int>(wasm_i8x16_bitmask(simde__m128i_to_wasm_v128(v)));
}
inline int highestBitsOf32(simde__m128i v) {
  return static_cast<int>(wasm_i32x4_bitmask(simde__m128i_to_wasm_v128(v)));
}
inline simde__m128i dotPairsOf16(simde__m128i a, simde__m128i b) {
  return simde__m128i_from_wasm_v128(
      wasm_i32x4_dot_i16x8(simde__m128i_to_wasm_v128(a), simde__m128i_to_wasm_v128(b)));
}
#else
inline int highestBitsOf8(simde__m128i v) {
  return simde_mm_movemask_epi8(v);
}
inline int highestBitsOf32(simde__m128i v) {
  return simde_mm_movemask_ps(simde_mm_castsi128_ps(v));
}
inline simde__m128i dotPairsOf16(simde__m128i a, simde__m128i b) {
  return simde_mm_madd_epi16(a, b);
}
#endif

// Addresses of loads and stores are aligned to 16 bytes. Arithmetic is modulo the lane's width unless a
// comment says otherwise.
struct Int32x4 {
  simde__m128i v;

  static Int32x4 load(const std::int32_t* from) {
    return {simde_mm_load_si128(reinterpret_cast<const simde__m128i*>(from))};
  }
  void store(std::int32_t* to) const { simde_mm_store_si128(reinterpret_cast<simde__m128i*>(to), v); }
  static Int32x4 of(std::int32_t a0, std::int32_t a1, std::int32_t a2, std::int32_t a3) {
    return {simde_mm_setr_epi32(a0, a1, a2, a3)};
  }
  static Int32x4 all(std::int32_t value) { return {simde_mm_set1_epi32(value)}; }
  friend Int32x4 operator+(Int32x4 a, Int32x4 b) { return {simde_mm_add_epi32(a.v, b.v)}; }
  friend Int32x4 operator-(Int32x4 a, Int32x4 b) { return {simde_mm_sub_epi32(a.v, b.v)}; }
  friend Int32x4 operator*(Int32x4 a, std::int32_t b) {
    return {simde_mm_mullo_epi32(a.v, simde_mm_set1_epi32(b))};
  }
  // Arithmetic shift: keeps the sign.
  Int32x4 shiftedRight(int bits) const { return {simde_mm_sra_epi32(v, simde_mm_cvtsi32_si128(bits))}; }
  Int32x4 shiftedLeft(int bits) const { return {simde_mm_sll_epi32(v, simde_mm_cvtsi32_si128(bits))}; }
  // Logical shift: brings in zeros.
  Int32x4 bitsShiftedRight(int bits) const { return {simde_mm_srl_epi32(v, simde_mm_cvtsi32_si128(bits))}; }
  // True if the first three lanes are equal.
  bool sameThree(Int32x4 other) const {
    return (highestBitsOf8(simde_mm_cmpeq_epi32(v, other.v)) & 0xfff) == 0xfff;
  }
  friend Int32x4 operator&(Int32x4 a, Int32x4 b) { return {simde_mm_and_si128(a.v, b.v)}; }
  friend Int32x4 operator|(Int32x4 a, Int32x4 b) { return {simde_mm_or_si128(a.v, b.v)}; }
  friend Int32x4 operator^(Int32x4 a, Int32x4 b) { return {simde_mm_xor_si128(a.v, b.v)}; }
  // Bits of b that are not set in a.
  static Int32x4 without(Int32x4 a, Int32x4 b) { return {simde_mm_andnot_si128(a.v, b.v)}; }
  // All bits of a lane if the comparison holds, otherwise none.
  friend Int32x4 operator>(Int32x4 a, Int32x4 b) { return {simde_mm_cmpgt_epi32(a.v, b.v)}; }
  friend Int32x4 operator==(Int32x4 a, Int32x4 b) { return {simde_mm_cmpeq_epi32(a.v, b.v)}; }
  Int32x4 magnitude() const {
    const Int32x4 sign = shiftedRight(31);
    return (*this ^ sign) - sign;
  }
  // Highest bit of each lane, as a number of four bits.
  int signs() const { return highestBitsOf32(v); }
  std::int32_t fourth() const { return simde_mm_cvtsi128_si32(simde_mm_shuffle_epi32(v, 0xff)); }
};

// Lanes of `yes` where `mask` has all bits set, lanes of `no` where it has none.
inline Int32x4 select(Int32x4 mask, Int32x4 yes, Int32x4 no) {
  return (mask & yes) | Int32x4::without(mask, no);
}

struct Float32x4 {
  simde__m128 v;

  static Float32x4 of(Int32x4 a) { return {simde_mm_cvtepi32_ps(a.v)}; }
  static Float32x4 ofBits(Int32x4 a) { return {simde_mm_castsi128_ps(a.v)}; }
  static Float32x4 all(float value) { return {simde_mm_set1_ps(value)}; }
  static Float32x4 of(float a, float b, float c, float d) { return {simde_mm_setr_ps(a, b, c, d)}; }
  // Stores the first three lanes to any address.
  void storeThree(float* to) const {
    simde_mm_storel_pi(reinterpret_cast<simde__m64*>(to), v);
    simde_mm_store_ss(to + 2, simde_mm_movehl_ps(v, v));
  }
  Int32x4 bits() const { return {simde_mm_castps_si128(v)}; }
  // Rounds to nearest even; truncates towards zero. Gives -2^31 for values beyond 32 bits.
  Int32x4 rounded() const { return {simde_mm_cvtps_epi32(v)}; }
  Int32x4 truncated() const { return {simde_mm_cvttps_epi32(v)}; }
  Float32x4 magnitude() const { return {simde_mm_andnot_ps(simde_mm_set1_ps(-0.0f), v)}; }
  friend Float32x4 operator+(Float32x4 a, Float32x4 b) { return {simde_mm_add_ps(a.v, b.v)}; }
  friend Float32x4 operator-(Float32x4 a, Float32x4 b) { return {simde_mm_sub_ps(a.v, b.v)}; }
  friend Float32x4 operator*(Float32x4 a, Float32x4 b) { return {simde_mm_mul_ps(a.v, b.v)}; }
  // All bits of a lane if the comparison holds, otherwise none.
  friend Int32x4 operator>(Float32x4 a, Float32x4 b) {
    return {simde_mm_castps_si128(simde_mm_cmpgt_ps(a.v, b.v))};
  }
};
inline Float32x4 clamp(Float32x4 a, float low, float high) {
  return {simde_mm_min_ps(simde_mm_max_ps(a.v, simde_mm_set1_ps(low)), simde_mm_set1_ps(high))};
}
inline Float32x4 select(Int32x4 mask, Float32x4 yes, Float32x4 no) {
  return Float32x4::ofBits(select(mask, yes.bits(), no.bits()));
}

// Vectors of as many vertices as there are lanes.
template <class Lanes>
struct VectorsOf {
  Lanes x, y, z;
};
using Vectors4 = VectorsOf<Int32x4>;

// From x, y, z of each of four vertices to all x, all y, all z. The fourth lane of each vertex becomes `w`.
inline Vectors4 transposed(const std::array<Int32x4, 4>& a) {
  const simde__m128i low01 = simde_mm_unpacklo_epi32(a[0].v, a[1].v),
                     low23 = simde_mm_unpacklo_epi32(a[2].v, a[3].v);
  const simde__m128i high01 = simde_mm_unpackhi_epi32(a[0].v, a[1].v),
                     high23 = simde_mm_unpackhi_epi32(a[2].v, a[3].v);
  return {{simde_mm_unpacklo_epi64(low01, low23)},
          {simde_mm_unpackhi_epi64(low01, low23)},
          {simde_mm_unpacklo_epi64(high01, high23)}};
}
// The inverse; fourth lanes are zero.
inline std::array<Int32x4, 4> transposed(const Vectors4& a) {
  const simde__m128i zero = simde_mm_setzero_si128();
  const simde__m128i lowXy = simde_mm_unpacklo_epi32(a.x.v, a.y.v),
                     highXy = simde_mm_unpackhi_epi32(a.x.v, a.y.v);
  const simde__m128i lowZ = simde_mm_unpacklo_epi32(a.z.v, zero),
                     highZ = simde_mm_unpackhi_epi32(a.z.v, zero);
  return {{{simde_mm_unpacklo_epi64(lowXy, lowZ)},
           {simde_mm_unpackhi_epi64(lowXy, lowZ)},
           {simde_mm_unpacklo_epi64(highXy, highZ)},
           {simde_mm_unpackhi_epi64(highXy, highZ)}}};
}

struct Int16x8 {
  simde__m128i v;

  static Int16x8 load(const std::int16_t* from) {
    return {simde_mm_load_si128(reinterpret_cast<const simde__m128i*>(from))};
  }
  void store(std::int16_t* to) const { simde_mm_store_si128(reinterpret_cast<simde__m128i*>(to), v); }
  // Stores the first four lanes to any address.
  void storeFour(std::uint16_t* to) const { simde_mm_storel_epi64(reinterpret_cast<simde__m128i*>(to), v); }
  static Int16x8 zero() { return {simde_mm_setzero_si128()}; }
  static Int16x8 all(std::int16_t value) { return {simde_mm_set1_epi16(value)}; }
  static Int16x8 of(std::int16_t a0, std::int16_t a1, std::int16_t a2, std::int16_t a3, std::int16_t a4,
                    std::int16_t a5) {
    return {simde_mm_setr_epi16(a0, a1, a2, a3, a4, a5, 0, 0)};
  }
  // a0 a1, four times.
  static Int16x8 allPairs(std::int16_t a0, std::int16_t a1) {
    return {simde_mm_setr_epi16(a0, a1, a0, a1, a0, a1, a0, a1)};
  }
  // a0 a1 a2 0 a4 a5 a6 0.
  Int16x8 withoutFourth() const {
    return {simde_mm_and_si128(v, simde_mm_setr_epi16(-1, -1, -1, 0, -1, -1, -1, 0))};
  }
  // a1 a0 a3 a2 a5 a4 a7 a6.
  Int16x8 pairsSwapped() const {
    return {simde_mm_or_si128(simde_mm_slli_epi32(v, 16), simde_mm_srli_epi32(v, 16))};
  }
  // 0 a0 0 a2 0 a4 0 a6.
  Int16x8 evenToOdd() const { return {simde_mm_slli_epi32(v, 16)}; }
  // One pair of lanes, four times.
  template <int pair>
  Int16x8 broadcastPair() const {
    return {simde_mm_shuffle_epi32(v, pair * 0x55)};
  }
  // Even or odd lanes, sign-extended.
  Int32x4 even() const { return {simde_mm_srai_epi32(simde_mm_slli_epi32(v, 16), 16)}; }
  Int32x4 odd() const { return {simde_mm_srai_epi32(v, 16)}; }
  // Saturating subtraction.
  friend Int16x8 operator-(Int16x8 a, Int16x8 b) { return {simde_mm_subs_epi16(a.v, b.v)}; }
};

// Lanes of a, then of b, saturated.
inline Int16x8 narrow(Int32x4 a, Int32x4 b) {
  return {simde_mm_packs_epi32(a.v, b.v)};
}

// a0 b0 a1 b1 a2 b2 a3 b3.
inline Int16x8 interleave(Int16x8 a, Int16x8 b) {
  return {simde_mm_unpacklo_epi16(a.v, b.v)};
}
// a0 a4 a1 a5 a2 a6 a3 a7.
inline Int16x8 interleaveHalves(Int16x8 a) {
  return {simde_mm_unpacklo_epi16(a.v, simde_mm_unpackhi_epi64(a.v, a.v))};
}
// a4 b4 a5 b5 a6 b6 a7 b7.
inline Int16x8 interleaveUpper(Int16x8 a, Int16x8 b) {
  return {simde_mm_unpackhi_epi16(a.v, b.v)};
}
// a0 b1 a2 b3 a4 b5 a6 b7.
inline Int16x8 evenAndOdd(Int16x8 a, Int16x8 b) {
  const simde__m128i mask = simde_mm_set1_epi32(0xffff);
  return {simde_mm_or_si128(simde_mm_and_si128(a.v, mask), simde_mm_andnot_si128(mask, b.v))};
}

// The four bytes, lowest first, in the first four lanes; the other lanes are 0.
inline Int16x8 widenBytes(std::uint32_t bytes) {
  const simde__m128i all = simde_mm_cvtsi32_si128(static_cast<std::int32_t>(bytes));
  return {simde_mm_unpacklo_epi8(all, simde_mm_setzero_si128())};
}

// From the low 16 bits of 32-bit lanes: a0 b0 a1 b1 a2 b2 a3 b3.
inline Int16x8 pairs(Int32x4 a, Int32x4 b) {
  return {
      simde_mm_or_si128(simde_mm_and_si128(a.v, simde_mm_set1_epi32(0xffff)), simde_mm_slli_epi32(b.v, 16))};
}
// a0 0 a1 0 a2 0 a3 0.
inline Int16x8 pairs(Int32x4 a) {
  return {simde_mm_and_si128(a.v, simde_mm_set1_epi32(0xffff))};
}
// Alternates 32-bit lanes (a0 b0 a1 b1, a2 b2 a3 b3) and 64-bit lanes (a0 b0, a1 b1).
inline Int16x8 interleave32Low(Int16x8 a, Int16x8 b) {
  return {simde_mm_unpacklo_epi32(a.v, b.v)};
}
inline Int16x8 interleave32High(Int16x8 a, Int16x8 b) {
  return {simde_mm_unpackhi_epi32(a.v, b.v)};
}
inline Int16x8 interleave64Low(Int16x8 a, Int16x8 b) {
  return {simde_mm_unpacklo_epi64(a.v, b.v)};
}
inline Int16x8 interleave64High(Int16x8 a, Int16x8 b) {
  return {simde_mm_unpackhi_epi64(a.v, b.v)};
}

// Reinterprets the bits.
inline Int16x8 asHalves(Int32x4 a) {
  return {a.v};
}

// a0 b0 + a1 b1, a2 b2 + a3 b3, ...
inline Int32x4 dotPairs(Int16x8 a, Int16x8 b) {
  return {dotPairsOf16(a.v, b.v)};
}

// a0 + a1, a2 + a3, b0 + b1, b2 + b3.
inline Int32x4 addNeighbours(Int32x4 a, Int32x4 b) {
  const simde__m128 low = simde_mm_castsi128_ps(a.v), high = simde_mm_castsi128_ps(b.v);
  return {simde_mm_add_epi32(simde_mm_castps_si128(simde_mm_shuffle_ps(low, high, 0x88)),
                             simde_mm_castps_si128(simde_mm_shuffle_ps(low, high, 0xdd)))};
}

// Number of sixteen ascending values that are not above `wanted`. The last value is above it.
inline std::uint32_t countNotAbove(Int16x8 low, Int16x8 high, Int16x8 wanted) {
  const simde__m128i above =
      simde_mm_packs_epi16(simde_mm_cmpgt_epi16(low.v, wanted.v), simde_mm_cmpgt_epi16(high.v, wanted.v));
  return static_cast<std::uint32_t>(
      std::countr_zero(static_cast<std::uint32_t>(highestBitsOf8(above)) | 1u << 15));
}

// Two vectors, processed operation by operation: while one waits for a result, the processor works on the
// other.
template <class Lanes>
struct Twice {
  Lanes first, second;

  static Twice all(auto value) { return {Lanes::all(value), Lanes::all(value)}; }
  template <class Others>
  static Twice of(const Twice<Others>& a) {
    return {Lanes::of(a.first), Lanes::of(a.second)};
  }
  template <class Others>
  static Twice ofBits(const Twice<Others>& a) {
    return {Lanes::ofBits(a.first), Lanes::ofBits(a.second)};
  }
  static Twice without(const Twice& a, const Twice& b) {
    return {Lanes::without(a.first, b.first), Lanes::without(a.second, b.second)};
  }
  Twice shiftedRight(int bits) const { return {first.shiftedRight(bits), second.shiftedRight(bits)}; }
  Twice shiftedLeft(int bits) const { return {first.shiftedLeft(bits), second.shiftedLeft(bits)}; }
  Twice bitsShiftedRight(int bits) const {
    return {first.bitsShiftedRight(bits), second.bitsShiftedRight(bits)};
  }
  Twice magnitude() const { return {first.magnitude(), second.magnitude()}; }
  auto bits() const { return Twice<decltype(first.bits())>{first.bits(), second.bits()}; }
  auto truncated() const { return Twice<decltype(first.truncated())>{first.truncated(), second.truncated()}; }

  friend Twice operator+(const Twice& a, const Twice& b) { return {a.first + b.first, a.second + b.second}; }
  friend Twice operator-(const Twice& a, const Twice& b) { return {a.first - b.first, a.second - b.second}; }
  friend Twice operator*(const Twice& a, const Twice& b) { return {a.first * b.first, a.second * b.second}; }
  friend Twice operator&(const Twice& a, const Twice& b) { return {a.first & b.first, a.second & b.second}; }
  friend Twice operator|(const Twice& a, const Twice& b) { return {a.first | b.first, a.second | b.second}; }
  friend Twice<Int32x4> operator>(const Twice& a, const Twice& b) {
    return {a.first > b.first, a.second > b.second};
  }
  friend Twice<Int32x4> operator==(const Twice& a, const Twice& b) {
    return {a.first == b.first, a.second == b.second};
  }
};
template <class Lanes>
Twice<Lanes> select(const Twice<Int32x4>& mask, const Twice<Lanes>& yes, const Twice<Lanes>& no) {
  return {select(mask.first, yes.first, no.first), select(mask.second, yes.second, no.second)};
}
template <class Lanes>
Twice<Int16x8> pairs(const Twice<Lanes>& a, const Twice<Lanes>& b) {
  return {pairs(a.first, b.first), pairs(a.second, b.second)};
}
template <class Lanes>
Twice<Int16x8> pairs(const Twice<Lanes>& a) {
  return {pairs(a.first), pairs(a.second)};
}
inline Twice<Int16x8> asHalves(const Twice<Int32x4>& a) {
  return {asHalves(a.first), asHalves(a.second)};
}
inline Twice<Int32x4> dotPairs(const Twice<Int16x8>& a, const Twice<Int16x8>& b) {
  return {dotPairs(a.first, b.first), dotPairs(a.second, b.second)};
}

using Int32x8 = Twice<Int32x4>;
using Float32x8 = Twice<Float32x4>;
using Vectors8 = VectorsOf<Int32x8>;

inline Vectors4 firstOf(const Vectors8& a) {
  return {a.x.first, a.y.first, a.z.first};
}
inline Vectors4 secondOf(const Vectors8& a) {
  return {a.x.second, a.y.second, a.z.second};
}
inline Vectors8 both(const Vectors4& first, const Vectors4& second) {
  return {{first.x, second.x}, {first.y, second.y}, {first.z, second.z}};
}

}  // namespace clothstream::codec::hierarchical
