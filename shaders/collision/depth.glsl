// SPDX-License-Identifier: MIT
// Depth of a point inside a collider. The including kernel defines what collide.glsl needs.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_DEPTH_GLSL
#define CLOTHSTREAM_SHADERS_COLLISION_DEPTH_GLSL

#include "shaders/collision/collide.glsl"

// Depth below the shape's surface, along the nearest of its planes. At most 0 outside.
float depthIn(Collider collider, ColliderFrame frame, vec3 position) {
  precise vec3 offset = position - collider.after;
  precise vec3 p = rotateBack(frame.after, offset);
#if CLOTHSTREAM_SHAPE_KINDS != 4
#error "depthIn() does not know all kinds of shapes (measure_solids.comp has those of meshes)"
#endif
  if (frame.shape.kind == kRoundShape) {
    Ball ball = nearestBall(p, roundOf(frame.shape, 0.0));
    precise vec3 out_ = p - ball.centre;
    precise float squared = max(dotProduct(out_, out_), 1e-24);
    precise float depth = ball.radius - squared * reciprocalSquareRoot(squared);
    return depth;
  }
  bool isBox = frame.shape.kind == kBoxShape;
  uint count = isBox ? 6u : planeCountOf(frame.shape);
  float highest = -1e30;
  for (uint i = 0; i < count; ++i) {
    vec4 plane = isBox ? boxPlane(halfSizeOf(frame.shape), i)
                       : texelFetch(colliders, int(firstPlaneOf(frame.shape) + i));
    precise float height = dotProduct(plane.xyz, p) - plane.w;
    highest = max(highest, height);
  }
  precise float depth = -highest;
  return depth;
}

#endif
