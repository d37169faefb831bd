// SPDX-License-Identifier: MIT
// Float arithmetic that gives the same bits on every device.
//
// Vulkan fixes the result of addition, subtraction and multiplication alone; division, inversesqrt, dot,
// length and normalize may differ from device to device, and so may an expression that the compiler is free
// to contract or reorder. Kernels of the simulation therefore use only + - * and comparisons on `precise`
// variables, and these functions. Devices may also flush denormal numbers to zero or keep them: what is
// stored is snapped to zero below kTiny, far above the denormals, so that neither choice can be seen in the
// state.
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

// Where a is NaN it is b, unlike max(), whose result then is undefined.
float atLeast(float a, float b) {
  return a > b ? a : b;
}

// 1 / sqrt(x) for a finite, normal x > 0, with a relative error below 2^-23.
// Subtracting half of the bits from a constant negates and halves the exponent, which leaves a relative error
// of 3.5 %; constant and coefficients of the first step are the minimax choice over [1, 4) (error 6.5e-4);
// the second step is of third order (Halley), whose own error is below 1e-9: what remains is the rounding of
// its last operations.
float reciprocalSquareRoot(float x) {
#ifdef CLOTHSTREAM_BUILTIN_ARITHMETIC
  return inversesqrt(x);
#else
  precise float seed = uintBitsToFloat(0x5F5FC400u - (floatBitsToUint(x) >> 1));
  precise float first = seed * (1.19071327 - 0.249778119 * (x * seed * seed));
  precise float residual = 1.0 - (x * first) * first;
  precise float second = first + first * (residual * (0.5 + 0.375 * residual));
  return second;
#endif
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
