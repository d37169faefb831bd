// SPDX-License-Identifier: MIT
// Collides the nodes with the surfaces of the real room, after the colliders of a substep.
// Writes cannot race: each node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kSolidBinding = 2;
const int kContactImpulseBinding = 6;  // surfaces report no contacts
const int kSurfaceBinding = 7;
const int kColliderBinding = 8;  // neither colliders nor lists of near ones are used

#include "shaders/collision/collide.glsl"
#include "shaders/collision/surface_contact.glsl"
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
  SurfacePush push;
};

// Nodes that touch nothing are not written.
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
  vec3 velocity = velocities[index].xyz;
  float thickness = max(cloth.thickness, push.leastDistance);
  CollidingNode node = CollidingNode(index, uint(tile.cloth), here.w, thickness, cloth.friction);
  Press last = kNoPress;
  visitsLeft = kMostSurfaceVisits;
  bool touches = true, touched = false;
  for (uint round = 0u; round < push.rounds && touches; ++round) {
    SurfaceContact found = touchSurfaces(push, from, position, thickness, false);
    touches = found.contact.depth > 0.0;
    if (touches) {
      touched = true;
      SurfaceRecord surface = surfaceRecordAt(found.surface);
      precise float friction = cloth.friction * surface.friction;
      Collider collider =
          Collider(found.surface, surface.position, surface.position, vec3(0.0), 0.0, friction, thickness);
      leave(found.surface, collider, found.contact, vec3(0.0), vec3(0.0), push.collision, node, from, last,
            position, velocity);
    }
  }
  if (touched) {
    finishContacts(last, push.collision, node, from, position, velocity);
    touches = touchSurfaces(push, from, position, thickness, true).part <= 1.0;
  }
  // The node has found no place on its side, or its searches were cut short.
  if ((touched && touches) || visitsLeft == 0u) {
    position = from;
    velocity = vec3(0.0);
  }
  if (touched || visitsLeft == 0u) {
    positions[index].xyz = snapTiny(position);
    velocities[index].xyz = snapTiny(velocity);
  }
}
