// SPDX-License-Identifier: MIT
// Two directions along a surface and its normal, as in proto/codec/hierarchical/surface_frame.h.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_SURFACE_FRAME_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_SURFACE_FRAME_GLSL

const int kUnitBits = 14;

// Components are at most 2^kUnitBits.
struct SurfaceFrame {
  ivec3 u;
  ivec3 v;
  ivec3 n;
};

ivec3 combine(SurfaceFrame frame, ivec3 along) {
  return frame.u * along.x + frame.v * along.y + frame.n * along.z;
}

ivec3 project(SurfaceFrame frame, ivec3 a) {
  return ivec3(frame.u.x * a.x + frame.u.y * a.y + frame.u.z * a.z,
               frame.v.x * a.x + frame.v.y * a.y + frame.v.z * a.z,
               frame.n.x * a.x + frame.n.y * a.y + frame.n.z * a.z);
}

// The largest component to 13 bits. Returns whether the vector is not zero.
bool scaleVector(inout ivec3 a) {
  uvec3 magnitudes = uvec3(abs(a));
  int bits = findMSB(magnitudes.x | magnitudes.y | magnitudes.z) + 1;
  a = bits > 13 ? a >> (bits - 13) : a << (13 - bits);
  return bits > 0;
}

bool isNotAbove(uint root, uint factor) {
  uint high, low;
  umulExtended(root * root, factor, high, low);
  return high < 512u || (high == 512u && low == 0u);  // 2^41
}

// The largest with root^2 (2 n + 1) <= 2^41; n is from 1024 to 4095. The estimate is the device's own, the
// root is not: as a rule neither loop runs.
uint rootOf(uint n) {
  precise float estimate = 1048576.0 * inversesqrt(float(n) + 0.5);
  uint root = uint(estimate);
  while (isNotAbove(root + 1, 2 * n + 1)) {
    ++root;
  }
  while (!isNotAbove(root, 2 * n + 1)) {
    --root;
  }
  return root;
}

// To unit length; `a` is scaled.
ivec3 normalised(ivec3 a) {
  uint squared = uint(a.x * a.x + a.y * a.y + a.z * a.z);
  int raise = (27 - findMSB(squared)) & ~1;
  int root = int(rootOf((squared << raise) >> 16));
  int down = 14 - raise / 2;
  return (a * root + (1 << (down - 1))) >> down;
}

ivec3 crossOf(ivec3 a, ivec3 b) {
  return ivec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// u along `first`, n across both; the axes x, y, z where the two span no plane.
SurfaceFrame surfaceFrame(ivec3 first, ivec3 second) {
  const int kOne = 1 << kUnitBits;
  SurfaceFrame frame = SurfaceFrame(ivec3(kOne, 0, 0), ivec3(0, kOne, 0), ivec3(0, 0, kOne));
  bool isFirst = scaleVector(first);
  bool isSecond = scaleVector(second);
  if (!isFirst || !isSecond) {
    return frame;
  }
  ivec3 u = normalised(first);
  ivec3 n = crossOf(u, second);
  if (!scaleVector(n)) {
    return frame;
  }
  frame.u = u;
  frame.n = normalised(n);
  frame.v = (crossOf(frame.n, u) + kOne / 2) >> kUnitBits;
  return frame;
}

#endif
