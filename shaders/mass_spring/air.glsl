// SPDX-License-Identifier: MIT
// Drag and lift of a triangle in moving air.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_AIR_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_AIR_GLSL

#include "shaders/mass_spring/local_wind.glsl"
#include "shaders/mass_spring/node.glsl"
#include "shaders/shared/arithmetic.glsl"

// True if the air moves any cloth.
layout(constant_id = 3) const bool kAir = true;

struct Air {
  vec3 wind;
  float drag;  // coefficient times density / 6: half of the density, a third of it for each node
  float lift;
  uint localWinds;
};

// Force on each of the triangle's three nodes. With the air's velocity u relative to the triangle and the
// area vector N:
//   F = density / 2 (C_drag |N.u| u + C_lift (N.u) / (|u||N|) (N |u|^2 - (N.u) u))
// A triangle with two equal corners, such as at a cloth's edge, gives exactly zero.
vec3 airForce(Node a, Node b, Node c, Air air) {
  precise vec3 wind = air.wind;
  if (kLocalWinds) {
    precise vec3 middle = (a.position + b.position + c.position) * 0.33333334;
    wind = wind + localWindAt(middle, air.localWinds);
  }
  precise vec3 relative = wind - (a.velocity + b.velocity + c.velocity) * 0.33333334;
  precise vec3 area = 0.5 * crossProduct(b.position - a.position, c.position - a.position);
  precise float flow = dotProduct(area, relative);
  precise float speedSquared = dotProduct(relative, relative);
  precise float inverse = reciprocalSquareRoot(max(speedSquared * dotProduct(area, area), 1e-20));
  precise float lift = air.lift * flow * inverse;
  precise vec3 force = (air.drag * abs(flow) - lift * flow) * relative + (lift * speedSquared) * area;
  return force;
}

#endif
