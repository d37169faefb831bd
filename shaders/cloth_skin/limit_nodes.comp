// SPDX-License-Identifier: MIT
// Keeps nodes within their distance from their skinned places, and out of their backstops, at a substep's
// end. Writes cannot race: each node has at most one limit.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/cloth_skin/cloth_skin.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

// False leaves out code that no cloth needs.
layout(constant_id = 1) const bool kBackstops = true;

layout(binding = 0) uniform samplerBuffer limits;  // LimitRecord
layout(std430, binding = 1) buffer Positions {
  vec4 positions[];  // w: inverse mass
};
layout(std430, binding = 2) buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  LimitPush push;
};

struct State {
  vec3 position;  // relative to the skinned place
  vec3 velocity;  // relative to that of the skinned place
};

// Moves a node out of its backstop, and removes the velocity that leads into it. With the nearest point of
// the ball to the place as origin, the ball is  |q + r n| < r.  The difference of the squares keeps its
// digits where r is large.
State leaveBackstop(State node, vec3 normal, vec3 turn, float distance_, float radius) {
  precise float squaredNormal = max(dotProduct(normal, normal), 1e-12);
  precise vec3 n = normal * reciprocalSquareRoot(squaredNormal);
  precise vec3 q = node.position + distance_ * n;
  precise float inside = dotProduct(q, q) + (2.0 * radius) * dotProduct(q, n);
  if (inside >= 0.0) {
    return node;
  }
  precise vec3 fromCentre = q + radius * n;
  precise float squared = dotProduct(fromCentre, fromCentre);
  // At the centre every direction is as good; the normal leads to the front.
  precise float tiny = 1e-12 * (radius * radius);
  if (squared < tiny) {
    fromCentre = radius * n;
    squared = radius * radius;
    q = vec3(0.0);
    inside = 0.0;
  }
  precise float inverse = reciprocalSquareRoot(squared);
  precise float length_ = squared * inverse;
  precise float grow = -inside * inverse * reciprocal(length_ + radius);
  precise vec3 position = q + grow * fromCentre - distance_ * n;
  precise vec3 outwards = fromCentre * inverse;
  precise vec3 surface = (-push.tickRate * distance_) * turn;
  precise float entering = max(-dotProduct(node.velocity - surface, outwards), 0.0);
  precise vec3 velocity = node.velocity + entering * outwards;
  return State(position, velocity);
}

// Moves a node back to the surface of its ball, and removes the velocity that led beyond it.
State stayNear(State node, float distance_) {
  precise float squared = dotProduct(node.position, node.position);
  precise float most = distance_ * distance_;
  if (squared <= most) {
    return node;
  }
  precise vec3 direction = node.position * reciprocalSquareRoot(max(squared, 1e-24));
  precise float leaving = max(dotProduct(node.velocity, direction), 0.0);
  precise vec3 position = distance_ * direction;
  precise vec3 velocity = node.velocity - leaving * direction;
  return State(position, velocity);
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) {
    return;
  }
  int limit = CLOTHSTREAM_LIMIT_TEXELS * int(i);
  vec4 start = texelFetch(limits, limit), motion = texelFetch(limits, limit + 1);
  int index = int(motion.w);
  vec4 here = positions[index];
  if (here.w == 0.0) {
    return;
  }
  precise vec3 place = start.xyz + push.progress * motion.xyz;
  precise vec3 carried = push.tickRate * motion.xyz;
  precise vec3 away = here.xyz - place;
  precise vec3 speed = velocities[index].xyz - carried;
  State node = State(away, speed);
  if (kBackstops) {
    vec4 normal = texelFetch(limits, limit + 2), turn = texelFetch(limits, limit + 3);
    if (turn.w > 0.0) {
      precise vec3 facing = normal.xyz + push.progress * turn.xyz;
      node = leaveBackstop(node, facing, turn.xyz, normal.w, turn.w);
    }
  }
  node = stayNear(node, start.w);
  if (node.position == away) {
    return;
  }
  precise vec3 position = place + node.position;
  precise vec3 velocity = carried + node.velocity;
  positions[index].xyz = snapTiny(position);
  velocities[index].xyz = snapTiny(velocity);
}
