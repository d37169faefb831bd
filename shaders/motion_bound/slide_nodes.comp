// SPDX-License-Identifier: MIT
// Moves each node by the weighted mean of its corrections, and changes its velocity accordingly. The way of a
// node gets longer by at most 0.4 gaps, as find_pairs.comp assumes. Writes cannot race: each node belongs to
// one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/motion_bound/motion_bound.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer parts;  // PartRecord; the nodes come first
layout(std430, binding = 1) readonly buffer Starts {
  vec4 starts[];
};
layout(std430, binding = 2) buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 3) buffer Velocities {
  vec4 velocities[];
};
layout(std430, binding = 4) buffer Corrections {
  int corrections[];
};

layout(push_constant) uniform Push {
  NodePush push;
};

float metres(int units) {
  precise float sum = float(clamp(units, -16777216, 16777216)) * (1.0 / kCorrectionUnits);
  return sum;
}

float lengthOf(vec3 v) {
  precise float squared = max(dotProduct(v, v), 1e-20);
  precise float length = squared * reciprocalSquareRoot(squared);
  return length;
}

void main() {
  if (gl_GlobalInvocationID.x >= push.nodeCount) {
    return;
  }
  uint node = uint(partAt(parts, gl_GlobalInvocationID.x).first);
  int weight = corrections[4 * node + 3];
  if (weight == 0) {
    return;
  }
  vec4 here = positions[node];
  vec3 start = starts[node].xyz;
  vec3 sum = vec3(metres(corrections[4 * node]), metres(corrections[4 * node + 1]),
                  metres(corrections[4 * node + 2]));
  precise vec3 by = (kCorrectionWeight * reciprocal(float(max(weight, 1)))) * sum;
  precise vec3 way = here.xyz - start;
  precise vec3 corrected = way + by;
  precise float longest = lengthOf(way) + 0.4 * push.gap;
  float length = lengthOf(corrected);
  precise float share = longest * reciprocal(length);
  precise vec3 shortened = share * corrected;
  vec3 used = length > longest ? shortened : corrected;
  precise vec3 position = start + used;
  precise vec3 velocity = velocities[node].xyz + push.substepRate * (used - way);
  positions[node] = vec4(snapTiny(position), here.w);
  velocities[node] = vec4(snapTiny(velocity), 0.0);
  for (uint k = 0; k < 4; ++k) {
    corrections[4 * node + k] = 0;
  }
}
