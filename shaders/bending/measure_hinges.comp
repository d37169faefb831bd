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

// Minimum of (2 cos(delta / 2))^2, where delta is the angle from rest.
const float kOpposite = 1e-6;

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
  precise vec3 h1 = inverse1 * n1;
  precise vec3 h2 = inverse2 * n2;
  precise float sine = dotProduct(crossProduct(n2, n1), along);
  float cosine = dotProduct(n1, n2);
  // The sine and cosine of half of the angle at rest, then of the whole.
  precise float square = record.restQuarter * record.restQuarter;
  float inverse = reciprocal(1.0 + square);
  precise float halfSine = (2.0 * record.restQuarter) * inverse;
  precise float halfCosine = (1.0 - square) * inverse;
  precise float restSine = 2.0 * halfSine * halfCosine;
  precise float restCosine = halfCosine * halfCosine - halfSine * halfSine;
  precise float fromRestSine = sine * restCosine - cosine * restSine;
  precise float fromRestCosine = cosine * restCosine + sine * restSine;
  precise float twice = 2.0 + 2.0 * fromRestCosine;
  precise float bent = (2.0 * fromRestSine) * reciprocalSquareRoot(max(twice, kOpposite));
  precise float strength = -((rigidity * record.weight) * bent);
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
