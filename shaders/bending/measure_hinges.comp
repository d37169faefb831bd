// SPDX-License-Identifier: MIT
// Computes the forces of a hinge on its four nodes: model::HingeShape.
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
  vec4 forces[];  // four per hinge
};

layout(push_constant) uniform Push {
  BendingPush push;
};

// Least |n1 + n2|^2 of the unit normals; below it the faces lie on each other.
const float kFolded = 1e-6;

void main() {
  uint hinge = gl_GlobalInvocationID.x;
  if (hinge >= push.count) {
    return;
  }
  HingeRecord record = hingeAt(hinges, hinge);
  float rigidity = clothAt(cloths, uint(record.cloth)).bendingRigidity;
  vec3 a = texelFetch(positions, int(record.edgeStart)).xyz;
  vec3 b = texelFetch(positions, int(record.edgeEnd)).xyz;
  vec3 c = texelFetch(positions, int(record.firstOpposite)).xyz;
  vec3 d = texelFetch(positions, int(record.secondOpposite)).xyz;

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
  float inverse1 = reciprocalSquareRoot(max(dotProduct(first, first), record.leastSquare));
  float inverse2 = reciprocalSquareRoot(max(dotProduct(second, second), record.leastSquare));
  precise vec3 n1 = inverse1 * first;
  precise vec3 n2 = inverse2 * second;
  precise vec3 sum = n1 + n2;
  precise vec3 h1 = inverse1 * n1;
  precise vec3 h2 = inverse2 * n2;
  precise float sine = dotProduct(crossProduct(n2, n1), along);
  precise float bent = (2.0 * sine) * reciprocalSquareRoot(max(dotProduct(sum, sum), kFolded));
  precise float strength = (rigidity * record.weight) * (record.restBent - bent);
  precise vec3 onA = -dotProduct(bc, along) * h1 - dotProduct(bd, along) * h2;
  precise vec3 onB = dotProduct(ac, along) * h1 + dotProduct(ad, along) * h2;
  precise float length_ = squared * inverseLength;
  precise vec3 forceA = strength * onA;
  precise vec3 forceB = strength * onB;
  precise vec3 forceC = (strength * length_) * h1;
  precise vec3 forceD = (strength * length_) * h2;
  forces[4 * hinge] = vec4(forceA, 0.0);
  forces[4 * hinge + 1] = vec4(forceB, 0.0);
  forces[4 * hinge + 2] = vec4(forceC, 0.0);
  forces[4 * hinge + 3] = vec4(forceD, 0.0);
}
