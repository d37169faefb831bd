// SPDX-License-Identifier: MIT
// Rotations by unit quaternions (x, y, z, w).
#ifndef CLOTHSTREAM_SHADERS_SHARED_ROTATION_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_ROTATION_GLSL

#include "shaders/shared/arithmetic.glsl"

// The orientation after a share of the way from `start` to `start` plus `change`: the normalised mean of the
// two quaternions. One Newton step makes it more exact than our reciprocal square root.
vec4 orientationAt(vec4 start, vec4 change, float progress) {
  precise vec4 q = start + progress * change;
  precise float squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  precise float inverse = reciprocalSquareRoot(squared);
  precise float half_ = (0.5 * squared * inverse) * inverse;
  precise vec4 unit_ = q * (inverse * (1.5 - half_));
  return unit_;
}

vec3 rotate(vec4 q, vec3 v) {
  precise vec3 twice = 2.0 * crossProduct(q.xyz, v);
  precise vec3 rotated = v + q.w * twice + crossProduct(q.xyz, twice);
  return rotated;
}

vec3 rotateBack(vec4 q, vec3 v) {
  precise vec3 axis = -q.xyz;
  return rotate(vec4(axis, q.w), v);
}

#endif
