// SPDX-License-Identifier: MIT
// Whole numbers in tables of floats. A float is exact below 2^24, so a larger number takes two floats.
#ifndef CLOTHSTREAM_SHADERS_SHARED_WHOLE_NUMBER_H
#define CLOTHSTREAM_SHADERS_SHARED_WHOLE_NUMBER_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// A range of texels in another table.
struct ListRecord {
  float firstLow;  // wholeNumber(low, high)
  float firstHigh;
  float count;  // texels
  float reserved;
};

#ifdef __cplusplus

inline float lowHalf(std::size_t number) {
  return static_cast<float>(number & 0xFFFF);
}
inline float highHalf(std::size_t number) {
  return static_cast<float>(number >> 16);
}

inline uint32_t wholeNumber(float low, float high) {
  return static_cast<uint32_t>(low) + (static_cast<uint32_t>(high) << 16);
}

// Texels from `first` to before `end`.
inline ListRecord listRecord(std::size_t first, std::size_t end) {
  return {lowHalf(first), highHalf(first), static_cast<float>(end - first), 0};
}

#else

uint wholeNumber(float low, float high) {
  return uint(low) + (uint(high) << 16);
}

struct TexelRange {
  int first;
  int end;
};

TexelRange rangeOf(ListRecord list) {
  int first = int(wholeNumber(list.firstLow, list.firstHigh));
  return TexelRange(first, first + int(list.count));
}

ListRecord listAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return ListRecord(CLOTHSTREAM_FLOATS(texel));
}

#endif

CLOTHSTREAM_SHARED_END

#endif
