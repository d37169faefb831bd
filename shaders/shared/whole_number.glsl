// SPDX-License-Identifier: MIT
// Whole numbers in tables of floats, which are exact below 2^24: larger ones come in two halves.
#ifndef CLOTHSTREAM_SHADERS_SHARED_WHOLE_NUMBER_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_WHOLE_NUMBER_GLSL

uint wholeNumber(float low, float high) {
  return uint(low) + (uint(high) << 16);
}

#endif
