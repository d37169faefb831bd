// SPDX-License-Identifier: MIT
// The rows of J at the substep's start, and the right-hand sides: how long each constraint would become under
// the velocities that the forces alone give, [Va21] Eq. 11 times h^2, with C = |x_b - x_a| - r. A spring that
// may still be a force gets a row of zeros unless these velocities would stretch it too far, [Va21] 3.3.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer links;  // LinkRecord
layout(binding = 1) uniform samplerBuffer positions;
layout(binding = 2) uniform samplerBuffer freeVelocities;
layout(binding = 3) uniform samplerBuffer cloths;  // ClothRecord
layout(std430, binding = 4) writeonly buffer Rows {
  vec4 rows[];
};
layout(std430, binding = 5) writeonly buffer Multipliers {
  float multipliers[];
};
layout(std430, binding = 6) writeonly buffer Residuals {
  float residuals[];
};
layout(std430, binding = 7) writeonly buffer Directions {
  float directions[];
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
  vec4 limits = texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * int(ends.w) + 6);
  precise vec3 freeEnds = d + push.substepSeconds * relative;
  precise float longest = ends.z + limits.x * ends.z;
  bool isActive = limits.z == 0.0 || dotProduct(freeEnds, freeEnds) > longest * longest;

  precise float excess = squared * inverseLength - longest;
  precise float takenBack = excess > 0.0 || limits.z == 0.0 ? limits.y * excess : excess;
  precise float side = takenBack + push.substepSeconds * dotProduct(direction, relative);
  // The solve starts from no multipliers: residual and direction are the right-hand side.
  rows[link] = isActive ? vec4(direction, 0.0) : vec4(0.0);
  multipliers[link] = 0.0;
  residuals[link] = isActive ? side : 0.0;
  directions[link] = isActive ? side : 0.0;
}
