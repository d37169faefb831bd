// SPDX-License-Identifier: MIT
// Ends a substep after the springs: velocities follow from the new positions, [MMC16] Alg. 1; then the nodes
// collide.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 4;
const int kContactImpulseBinding = 9;

#include "shaders/collision/collide.glsl"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const bool kColliders = true;

layout(binding = 0) uniform samplerBuffer cloths;          // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;           // XpbdNodeTile
layout(binding = 2) uniform samplerBuffer startPositions;  // at the substep's start
layout(binding = 3) uniform samplerBuffer corrected;       // the same memory as `positions`
layout(std430, binding = 6) writeonly buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 7) writeonly buffer Velocities {
  vec4 velocities[];
};

layout(binding = 8) uniform samplerBuffer freeVelocities;  // the same memory as `velocities`

layout(push_constant) uniform Push {
  FinishPush push;
};

// Writes cannot race: each node belongs to one invocation.
void main() {
  XpbdNodeTile tile = xpbdNodeTileAt(tiles, push.firstTile + gl_WorkGroupID.x);
  ClothRecord cloth = clothAt(cloths, uint(tile.cloth));
  uint inCloth = uint(tile.firstNode) + gl_LocalInvocationID.x;
  if (inCloth >= nodeCountOf(cloth)) {
    return;
  }
  uint index = firstNodeOf(cloth) + inCloth;
  vec4 node = texelFetch(corrected, int(index));
  if (node.w == 0.0) {
    return;
  }
  vec3 from = texelFetch(startPositions, int(index)).xyz;
  vec3 free = texelFetch(freeVelocities, int(index)).xyz;
  // This is (x - start) / h without the rounding of start + h v, so that an uncorrected node falls as exactly
  // as its velocity grows.
  precise vec3 expected = from + push.substepSeconds * free;
  precise vec3 velocity = free + push.substepRate * (node.xyz - snapTiny(expected));
  vec3 position = node.xyz;
  if (kColliders) {
    CollidingNode collidingNode =
        CollidingNode(index, uint(tile.cloth), node.w, cloth.thickness, cloth.friction);
    collideWithAll(collidingNode, push.collision, from, position, velocity);
  }
  if (kColliders) {
    positions[index].xyz = snapTiny(position);
  }
  velocities[index].xyz = snapTiny(velocity);
}
