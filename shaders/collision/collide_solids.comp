// SPDX-License-Identifier: MIT
// Collides the nodes with the triangle meshes among the colliders, after every other stage of a substep.
// Writes cannot race: each node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kSolidBinding = 2;
const int kContactImpulseBinding = 6;
const int kColliderBinding = 7;  // the lists of near colliders are not used

#include "shaders/collision/collide.glsl"
#include "shaders/collision/solid_contact.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;          // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;           // NodeTileRecord
layout(binding = 3) uniform samplerBuffer startPositions;  // at the substep's start
layout(std430, binding = 4) buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 5) buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  SolidPush push;
};

// Velocity and mass stay in their buffers during the search, which needs nearly all registers.
void collideWithSolid(uint number, CollidingNode node, vec3 from, inout Press last, inout vec3 position) {
  Collider collider = fetchCollider(number, push.collision, node.thickness, node.friction);
  if (!mayTouch(collider, from, position)) {
    return;
  }
  ColliderFrame frame = fetchFrame(collider, push.collision);
  SolidRecord solid = solidRecordAt(solids, solidTexelOf(frame.shape));
  precise vec3 before = from - collider.before;
  precise vec3 after = position - collider.after;
  SolidContact touch = touchSolid(solid, rotateBack(frame.before, before), rotateBack(frame.after, after),
                                  push.collision.progressBefore, push.collision.progressAfter,
                                  solidMotionOf(frame.shape), node.thickness);
  if (touch.contact.depth > 0.0) {
    touch.contact.normal = rotate(frame.after, touch.contact.normal);
    precise vec3 surface = collider.velocity + push.collision.tickRate * rotate(frame.after, touch.motion);
    node.inverseMass = positions[node.index].w;
    vec3 velocity = velocities[node.index].xyz;
    leave(number, collider, touch.contact, surface, frame.spin, push.collision, node, from, last, position,
          velocity);
    velocities[node.index].xyz = velocity;
  }
}

void main() {
  NodeTileRecord tile = nodeTileAt(tiles, gl_WorkGroupID.x);
  ClothRecord cloth = clothAt(cloths, uint(tile.cloth));
  uint inCloth = uint(tile.firstNode) + gl_LocalInvocationID.x;
  if (inCloth >= nodeCountOf(cloth)) {
    return;
  }
  uint index = firstNodeOf(cloth) + inCloth;
  vec4 here = positions[index];
  if (here.w == 0.0) {
    return;
  }
  vec3 from = texelFetch(startPositions, int(index)).xyz;
  vec3 position = here.xyz;
  CollidingNode node = CollidingNode(index, uint(tile.cloth), 0.0, cloth.thickness, cloth.friction);
  Press last = kNoPress;
  for (uint solid = 0u; solid < push.solidCount; ++solid) {
    collideWithSolid(push.collision.colliderCount + solid, node, from, last, position);
  }
  node.inverseMass = positions[index].w;
  vec3 velocity = velocities[index].xyz;
  finishContacts(last, push.collision, node, from, position, velocity);
  positions[index].xyz = snapTiny(position);
  velocities[index].xyz = snapTiny(velocity);
}
