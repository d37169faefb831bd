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

struct Sphere {
  vec3 centre;
  vec3 velocity;
  float radius;    // with the cloth's thickness
  float friction;  // with the cloth's
};

// `progress` is the part of the tick's motion that is done, `rate` one over the tick's seconds.
Sphere fetchSphere(uint index, float progress, float rate, float thickness, float friction) {
  vec4 startRadius = texelFetch(spheres, int(2 * index));
  vec4 motionFriction = texelFetch(spheres, int(2 * index + 1));
  precise vec3 centre = startRadius.xyz + progress * motionFriction.xyz;
  precise vec3 velocity = rate * motionFriction.xyz;
  precise float radius = startRadius.w + thickness;
  precise float both = friction * motionFriction.w;
  return Sphere(centre, velocity, radius, both);
}

// Out of the sphere along its normal; the velocity relative to the sphere loses what goes into it, and, of
// what goes along it, at most friction times that. Pinned nodes stay.
Node collideWithSphere(Node node, Sphere sphere) {
  precise vec3 offset = node.position - sphere.centre;
  precise float squared = dotProduct(offset, offset);
  precise float radiusSquared = sphere.radius * sphere.radius;
  if (squared < radiusSquared && node.inverseMass > 0.0) {
    precise vec3 normal = squared < 1e-24 ? vec3(0.0, 1.0, 0.0) : offset * reciprocalSquareRoot(squared);
    precise vec3 surface = sphere.centre + sphere.radius * normal;
    node.position = surface;
    precise vec3 relative = node.velocity - sphere.velocity;
    precise float approach = dotProduct(relative, normal);
    if (approach < 0.0) {
      precise vec3 slip = relative - approach * normal;
      precise float inverseSlip = reciprocalSquareRoot(max(dotProduct(slip, slip), 1e-30));
      precise float kept = max(1.0 + sphere.friction * approach * inverseSlip, 0.0);
      precise vec3 after = sphere.velocity + kept * slip;
      node.velocity = after;
    }
  }
  return node;
}

#endif
