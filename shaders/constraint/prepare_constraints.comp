// SPDX-License-Identifier: MIT
// The rows of J at the substep's start, and the right-hand sides: how long each constraint would become under
// the velocities that the forces alone give, [Va21] Eq. 11 times h^2, with C = |x_b - x_a| - r.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer links;  // LinkRecord
layout(binding = 1) uniform samplerBuffer positions;
layout(binding = 2) uniform samplerBuffer freeVelocities;
layout(std430, binding = 3) writeonly buffer Rows {
  vec4 rows[];
};

layout(push_constant) uniform Push {
  ConstraintPush push;
};

void main() {
  uint link = gl_GlobalInvocationID.x;
  if (link >= push.count) {
    return;
  }
  vec4 ends = texelFetch(links, int(link));
  int a = int(ends.x);
  int b = int(ends.y);
  precise vec3 d = texelFetch(positions, b).xyz - texelFetch(positions, a).xyz;
  precise float squared = max(dotProduct(d, d), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise vec3 direction = d * inverseLength;
  precise vec3 relative = texelFetch(freeVelocities, b).xyz - texelFetch(freeVelocities, a).xyz;
  precise float stretch = squared * inverseLength - ends.z;
  precise float side = stretch + push.substepSeconds * dotProduct(direction, relative);
  rows[link] = vec4(direction, side);
}
