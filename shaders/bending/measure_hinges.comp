// SPDX-License-Identifier: MIT
// The forces of a hinge on its four nodes, as scene::HingeShape says.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/bending/bending.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer hinges;  // HingeRecord
layout(binding = 2) uniform samplerBuffer positions;
layout(std430, binding = 3) writeonly buffer Forces {
  vec4 forces[];  // four a hinge
};

layout(push_constant) uniform Push {
  BendingPush push;
};

// Below this |n1 + n2|^2 of unit normals the faces lie on each other.
const float kFolded = 1e-6;

void main() {
  uint hinge = gl_GlobalInvocationID.x;
  if (hinge >= push.count) {
    return;
  }
  vec4 nodes = texelFetch(hinges, int(hinge) * CLOTHSTREAM_HINGE_TEXELS);
  vec4 rest = texelFetch(hinges, int(hinge) * CLOTHSTREAM_HINGE_TEXELS + 1);
  float rigidity = texelFetch(cloths, int(rest.w) * CLOTHSTREAM_CLOTH_TEXELS + 6).w;
  vec3 a = texelFetch(positions, int(nodes.x)).xyz;
  vec3 b = texelFetch(positions, int(nodes.y)).xyz;
  vec3 c = texelFetch(positions, int(nodes.z)).xyz;
  vec3 d = texelFetch(positions, int(nodes.w)).xyz;

  precise vec3 edge = b - a;
  precise vec3 ac = a - c;
  precise vec3 bc = b - c;
  precise vec3 ad = a - d;
  precise vec3 bd = b - d;
  precise float squared = max(dotProduct(edge, edge), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise vec3 along = inverseLength * edge;
  vec3 first = crossProduct(ac, bc);
  vec3 second = crossProduct(bd, ad);
  float inverse1 = reciprocalSquareRoot(max(dotProduct(first, first), rest.z));
  float inverse2 = reciprocalSquareRoot(max(dotProduct(second, second), rest.z));
  precise vec3 n1 = inverse1 * first;
  precise vec3 n2 = inverse2 * second;
  precise vec3 sum = n1 + n2;
  precise vec3 h1 = inverse1 * n1;
  precise vec3 h2 = inverse2 * n2;
  precise float sine = dotProduct(crossProduct(n2, n1), along);
  precise float bent = (2.0 * sine) * reciprocalSquareRoot(max(dotProduct(sum, sum), kFolded));
  precise float strength = (rigidity * rest.x) * (rest.y - bent);
  precise vec3 onA = -dotProduct(bc, along) * h1 - dotProduct(bd, along) * h2;
  precise vec3 onB = dotProduct(ac, along) * h1 + dotProduct(ad, along) * h2;
  precise float length_ = squared * inverseLength;
  forces[4 * hinge] = vec4(strength * onA, 0.0);
  forces[4 * hinge + 1] = vec4(strength * onB, 0.0);
  forces[4 * hinge + 2] = vec4((strength * length_) * h1, 0.0);
  forces[4 * hinge + 3] = vec4((strength * length_) * h2, 0.0);
}
