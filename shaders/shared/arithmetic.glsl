// SPDX-License-Identifier: MIT
// Float arithmetic that gives the same bits on every device.
//
// Vulkan fixes the result of addition, subtraction and multiplication only. Division, inversesqrt, dot,
// length and normalize may differ between devices. So may an expression that the compiler is free to contract
// or reorder. Kernels of the simulation therefore use only + - * and comparisons on `precise` variables, the
// functions below, and max() if neither side is NaN. Devices may flush denormal numbers to zero or keep them.
// Stored values below kTiny, which is far above the denormals, become zero, so that the state shows neither
// choice.
#ifndef CLOTHSTREAM_SHADERS_SHARED_ARITHMETIC_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_ARITHMETIC_GLSL

const float kTiny = 1e-20;

float dotProduct(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}

vec3 crossProduct(vec3 a, vec3 b) {
  precise vec3 c = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return c;
}

// 1 / sqrt(x) for a finite, normal x > 0, with a relative error below 7e-7.
// Subtracting half of the bits from a constant negates and halves the exponent. For every x, x seed^2 then
// lies in [0.875, 0.9924]. With u = 1 - x seed^2, the remaining factor is (1 - u)^(-1/2). It is computed by
// its minimax cubic over that range (error 6.5e-7; the rest is rounding). The error of a spring's length
// stays below the rounding of its ends' positions, which is 1e-7 of their distance from the origin.
float reciprocalSquareRoot(float x) {
#ifdef CLOTHSTREAM_BUILTIN_ARITHMETIC
  return inversesqrt(x);
#else
  precise float seed = uintBitsToFloat(0x5F300000u - (floatBitsToUint(x) >> 1));
  precise float u = 1.0 - (x * seed) * seed;
  precise float root = seed * (0.999997973 + u * (0.500250757 + u * (0.367106825 + u * 0.398869693)));
  return root;
#endif
}

// 1 / x for a finite, normal x > 0 whose inverse is normal too, with a relative error below 3e-7: the square
// of reciprocalSquareRoot(x) and one Newton step.
float reciprocal(float x) {
  float root = reciprocalSquareRoot(x);
  precise float seed = root * root;
  precise float inverse = seed * (2.0 - x * seed);
  return inverse;
}

float snapTiny(float x) {
#ifdef CLOTHSTREAM_BUILTIN_ARITHMETIC
  return x;
#else
  return abs(x) < kTiny ? 0.0 : x;
#endif
}

vec3 snapTiny(vec3 v) {
  return vec3(snapTiny(v.x), snapTiny(v.y), snapTiny(v.z));
}

#endif
