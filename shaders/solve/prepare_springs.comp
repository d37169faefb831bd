// SPDX-License-Identifier: MIT
// Computes the terms of the springs of meshes at the substep's start (WeightedSpring), and the impulse on the
// first end of each spring. An invocation handles one spring.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/spring_terms.glsl"

layout(binding = 10) uniform samplerBuffer springs;  // LinkRecord
layout(std430, binding = 11) writeonly buffer Rows {
  vec4 rows[];  // WeightedSpring
};
layout(std430, binding = 12) writeonly buffer Impulses {
  vec4 impulses[];
};

void main() {
  uint index = push.firstSpring + gl_GlobalInvocationID.x;
  if (index >= push.endSpring) {
    return;
  }
  LinkRecord link = linkAt(springs, index);
  ClothRecord cloth = clothAt(cloths, uint(link.clothAndKind) / CLOTHSTREAM_SPRING_KINDS);
  uint kind = uint(link.clothAndKind) % CLOTHSTREAM_SPRING_KINDS;
  float stiffness =
      kind == 0 ? cloth.structuralStiffness : (kind == 1 ? cloth.shearStiffness : cloth.bendStiffness);
  float damping = kind == 0 ? cloth.structuralDamping : (kind == 1 ? cloth.shearDamping : cloth.bendDamping);
  SpringKind terms = springKind(link.restLength, stiffness, damping);
  End a = endAt(uint(link.a));
  End b = endAt(uint(link.b));
  Weight weight = weightOf(a, b, terms, cloth, true);
  precise float root = weight.along > 1e-30 ? weight.along * reciprocalSquareRoot(weight.along) : 0.0;
  precise vec3 row = root * (b.place - a.place);
  rows[index] = vec4(row, weight.across);
  impulses[index] = vec4(weight.impulse, 0.0);
}
