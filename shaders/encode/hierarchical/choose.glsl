// SPDX-License-Identifier: MIT
// Chooses the residuals of a vertex and computes its position, as in
// proto/codec/hierarchical/hierarchical_encoder.cpp.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_CHOOSE_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_CHOOSE_GLSL

#include "shaders/encode/hierarchical/slots.glsl"
#include "shaders/encode/hierarchical/surface_frame.glsl"

// Rounds to the nearest integer, and to the even one of two.
int nearest(float x) {
  return int(roundEven(x));
}
ivec3 nearest(vec3 x) {
  return ivec3(roundEven(x));
}

// The difference in steps along u, v and n.
vec3 inSteps(SurfaceFrame frame, ivec3 difference) {
  float scale = uintBitsToFloat((127 - uint(kUnitBits) - push.stepBits) << 23);
  precise vec3 d = scale * vec3(difference);
  precise float u = float(frame.u.x) * d.x + float(frame.u.y) * d.y + float(frame.u.z) * d.z;
  precise float v = float(frame.v.x) * d.x + float(frame.v.y) * d.y + float(frame.v.z) * d.z;
  precise float n = float(frame.n.x) * d.x + float(frame.n.y) * d.y + float(frame.n.z) * d.z;
  return vec3(u, v, n);
}

// Replaces `residual` and its `error` by the next smaller residual, if the vertex then stays within half the
// diagonal of a cube of steps.
void tryLess(float wished, vec3 errors, inout int residual, inout float error) {
  int smaller = residual - ((residual >> 31) | 1);
  precise float moved = wished - float(smaller);
  precise float rest = errors.x * errors.x + errors.y * errors.y + errors.z * errors.z - error * error;
  precise float squared = rest + moved * moved;
  if (residual != 0 && !(squared > 0.75)) {
    residual = smaller;
    error = moved;
  }
}

// Prefers smaller residuals along the surface; along the normal it takes the nearest.
ivec3 economise(vec3 wish) {
  ivec3 r = nearest(wish);
  precise vec3 errors = wish - vec3(r);
  // The component with the larger error comes first.
  bool isU = abs(errors.x) > abs(errors.y);
  for (uint i = 0; i < 2; ++i, isU = !isU) {
    if (isU) {
      tryLess(wish.x, errors, r.x, errors.x);
    } else {
      tryLess(wish.y, errors, r.y, errors.y);
    }
  }
  return r;
}

bool isBeyond16Bits(ivec3 r) {
  return saturate16(r) != r;
}

// Displacement of a vertex by residuals below 2^27, in units. The shifted sum of three products fits 32 bits,
// although the products do not. Their high parts are shifted separately and wrap in the same way.
ivec3 movedBy(SurfaceFrame frame, ivec3 r) {
  int down = kUnitBits - int(push.stepBits);
  ivec3 low = combine(frame, r & 0xFFF) + (1 << (down - 1));
  ivec3 high = combine(frame, r >> 12);
  return (high << (12 - down)) + (low >> down);
}

ivec3 reconstruct(SurfaceFrame frame, ivec3 position, ivec3 r) {
  const int kFar = 1 << 28;
  return clamp(position + movedBy(frame, r), -kFar, kFar);
}

// Chooses residuals and returns the position that they lead to. The surface frame is orthonormal to one part
// in thousands: long displacements need further corrections.
ivec3 choose(SurfaceFrame frame, ivec3 position, ivec3 target, out ivec3 residual) {
  residual = economise(inSteps(frame, target - position));
  ivec3 reached = position + movedBy(frame, residual);
  if (!isBeyond16Bits(residual) && isPromised(target - reached)) {
    return reached;
  }
  reached = reconstruct(frame, position, residual);
  for (uint look = 0; look < 8 && !isPromised(reached - target); ++look) {
    residual += nearest(inSteps(frame, target - reached));
    reached = reconstruct(frame, position, residual);
  }
  return reached;
}

#endif
