// SPDX-License-Identifier: MIT
// The hash of a decoder's reconstruction: FRAME_FORMAT.md, "Reconstruction hash".
#ifndef CLOTHSTREAM_SHADERS_ENCODE_RECONSTRUCTION_HASH_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_RECONSTRUCTION_HASH_GLSL

const uint kLowSeed = 0x243F6A88u;
const uint kHighSeed = 0x85A308D3u;

uint mixBits(uint h) {
  h = (h ^ (h >> 16)) * 0x7FEB352Du;
  h = (h ^ (h >> 15)) * 0x846CA68Bu;
  return h ^ (h >> 16);
}

uint hashWord(uint vertex, ivec3 q, uint normal, uint seed) {
  uint h = mixBits(vertex + seed);
  h = mixBits(h ^ uint(q.x));
  h = mixBits(h ^ uint(q.y));
  h = mixBits(h ^ uint(q.z));
  return mixBits(h ^ normal);
}

#endif
