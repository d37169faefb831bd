// SPDX-License-Identifier: MIT
// The springs of meshes at the substep's start: d times the root of their weight along it, and their weight
// across; and the impulse that they give their first end. One spring an invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/spring_terms.glsl"

layout(binding = 10) uniform samplerBuffer springs;  // LinkRecord
layout(std430, binding = 11) writeonly buffer Rows {
  vec4 rows[];
};
layout(std430, binding = 12) writeonly buffer Impulses {
  vec4 impulses[];
};

void main() {
  uint index = push.firstSpring + gl_GlobalInvocationID.x;
  if (index >= push.endSpring) {
    return;
  }
  vec4 ends = texelFetch(springs, int(index));
  int cloth = CLOTHSTREAM_CLOTH_TEXELS * int(uint(ends.w) / CLOTHSTREAM_SPRING_KINDS);
  uint kind = uint(ends.w) % CLOTHSTREAM_SPRING_KINDS;
  precise float elastic = push.substepSeconds * push.substepSeconds * texelFetch(cloths, cloth + 2)[kind];
  precise float viscous = push.substepSeconds * texelFetch(cloths, cloth + 3)[kind];
  End a = endAt(uint(ends.x));
  End b = endAt(uint(ends.y));
  Weight weight = weigh(a, b, Kind(ends.z, elastic, viscous), texelFetch(cloths, cloth + 6), true);
  precise float root = weight.along > 1e-30 ? weight.along * reciprocalSquareRoot(weight.along) : 0.0;
  precise vec3 row = root * (b.place - a.place);
  rows[index] = vec4(row, weight.across);
  impulses[index] = vec4(weight.impulse, 0.0);
}
