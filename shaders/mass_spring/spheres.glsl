// SPDX-License-Identifier: MIT
// Collision of a node with moving spheres, with Coulomb friction: [Va21] 3.4, Alg. 4.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_SPHERES_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_SPHERES_GLSL

#include "shaders/mass_spring/node.glsl"
#include "shaders/shared/arithmetic.glsl"

// Whether there is a sphere at all.
layout(constant_id = 4) const bool kSpheres = true;

// Two texels a sphere (SphereRecord).
layout(binding = 6) uniform samplerBuffer spheres;

// Out of the sphere along its normal; the velocity relative to the sphere loses what goes into it, and, of
// what goes along it, at most friction times that.
Node collideWithSphere(Node node, vec3 centre, vec3 velocity, float radius, float friction) {
  precise vec3 offset = node.position - centre;
  precise float squared = dotProduct(offset, offset);
  precise float radiusSquared = radius * radius;
  if (squared < radiusSquared) {
    precise vec3 normal = squared < 1e-24 ? vec3(0.0, 1.0, 0.0) : offset * reciprocalSquareRoot(squared);
    precise vec3 surface = centre + radius * normal;
    node.position = surface;
    precise vec3 relative = node.velocity - velocity;
    precise float approach = dotProduct(relative, normal);
    if (approach < 0.0) {
      precise vec3 slip = relative - approach * normal;
      precise float inverseSlip = reciprocalSquareRoot(atLeast(dotProduct(slip, slip), 1e-30));
      precise float kept = atLeast(1.0 + friction * approach * inverseSlip, 0.0);
      precise vec3 after = velocity + kept * slip;
      node.velocity = after;
    }
  }
  return node;
}

// In the order of the spheres, of which there must be one. `progress` is the part of their motion that is
// done, `rate` one over its seconds.
Node collideWithSpheres(Node node, uint count, float progress, float rate, float thickness, float friction) {
  int texel = 0;
  do {
    vec4 startRadius = texelFetch(spheres, texel);
    vec4 motionFriction = texelFetch(spheres, texel + 1);
    precise vec3 centre = startRadius.xyz + progress * motionFriction.xyz;
    precise vec3 velocity = rate * motionFriction.xyz;
    precise float radius = startRadius.w + thickness;
    precise float both = friction * motionFriction.w;
    node = collideWithSphere(node, centre, velocity, radius, both);
    texel += 2;
  } while (texel < int(2 * count));
  return node;
}

#endif
