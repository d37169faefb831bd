// SPDX-License-Identifier: MIT
// What every spring adds to the system of implicit Euler: its part of h D + h^2 K at the substep's start, and
// the impulse h^2 K v by which it brakes the velocities that the nodes have.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer springs;  // LinkRecord
layout(binding = 1) uniform samplerBuffer positions;
layout(binding = 2) uniform samplerBuffer velocities;
layout(binding = 3) uniform samplerBuffer cloths;  // ClothRecord
layout(std430, binding = 4) writeonly buffer Rows {
  vec4 rows[];
};
layout(std430, binding = 5) writeonly buffer Impulses {
  vec4 impulses[];
};

layout(push_constant) uniform Push {
  ConstraintPush push;
};

// With n from a to b, l the length and r the rest length:
//   h D + h^2 K = along n n^T + across (I - n n^T),  along = h d + h^2 k,  across = h^2 k max(0, 1 - r / l).
// A row keeps n sqrt(along - across) and `across`. What pushes across a compressed spring is left out, so
// that the matrix is positive definite.
void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) {
    return;
  }
  vec4 ends = texelFetch(springs, int(index));
  int a = int(ends.x);
  int b = int(ends.y);
  uint cloth = uint(ends.w) / CLOTHSTREAM_SPRING_KINDS;
  uint kind = uint(ends.w) % CLOTHSTREAM_SPRING_KINDS;
  int record = CLOTHSTREAM_CLOTH_TEXELS * int(cloth);
  float stiffness = texelFetch(cloths, record + 2)[kind];
  float damping = texelFetch(cloths, record + 3)[kind];

  precise vec3 d = texelFetch(positions, b).xyz - texelFetch(positions, a).xyz;
  float inverseLength = reciprocalSquareRoot(max(dotProduct(d, d), 1e-12));
  precise vec3 direction = d * inverseLength;
  precise vec3 change = texelFetch(velocities, b).xyz - texelFetch(velocities, a).xyz;

  precise float elastic = push.substepSeconds * push.substepSeconds * stiffness;
  precise float viscous = push.substepSeconds * damping;
  precise float across = elastic * max(1.0 - ends.z * inverseLength, 0.0);
  precise float difference = elastic + viscous - across;
  precise float root = difference > 1e-30 ? difference * reciprocalSquareRoot(difference) : 0.0;
  precise float alongImpulse = (elastic - across) * dotProduct(direction, change);
  precise vec3 row = root * direction;
  precise vec3 impulse = alongImpulse * direction + across * change;
  rows[index] = vec4(row, across);
  impulses[index] = vec4(impulse, 0.0);
}
