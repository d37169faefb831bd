// SPDX-License-Identifier: MIT
// After the springs of a substep: velocities from where the nodes are now, [MMC16] Alg. 1; then collisions.
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
layout(binding = 1) uniform samplerBuffer tiles;           // cloth, first node in it
layout(binding = 2) uniform samplerBuffer startPositions;  // of the substep
layout(binding = 3) uniform samplerBuffer corrected;       // the same as the next but one
layout(std430, binding = 6) writeonly buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 7) writeonly buffer Velocities {
  vec4 velocities[];
};

layout(binding = 8) uniform samplerBuffer freeVelocities;  // the same as the last

layout(push_constant) uniform Push {
  FinishPush push;
};

// Writes cannot race: each node belongs to one invocation.
void main() {
  vec4 tile = texelFetch(tiles, int(push.firstTile + gl_WorkGroupID.x));
  int cloth = CLOTHSTREAM_CLOTH_TEXELS * int(tile.x);
  vec4 place = texelFetch(cloths, cloth);
  uint inCloth = uint(tile.y) + gl_LocalInvocationID.x;
  uint count = uint(place.w) * uint(max(place.z, 1.0));
  if (inCloth >= count) {
    return;
  }
  uint index = uint(place.x) + (uint(place.y) << 16) + inCloth;
  vec4 node = texelFetch(corrected, int(index));
  if (node.w == 0.0) {
    return;
  }
  vec3 from = texelFetch(startPositions, int(index)).xyz;
  vec3 free = texelFetch(freeVelocities, int(index)).xyz;
  // (x - start) / h, but for the rounding of start + h v: without it a node that nothing corrects falls as
  // exactly as its velocity grows.
  precise vec3 expected = from + push.substepSeconds * free;
  precise vec3 velocity = free + push.substepRate * (node.xyz - snapTiny(expected));
  vec3 position = node.xyz;
  if (kColliders) {
    collideWithAll(index, CollidingNode(uint(tile.x), node.w), push.collision, texelFetch(cloths, cloth + 3).w,
                   texelFetch(cloths, cloth + 2).w, from, position, velocity);
  }
  if (kColliders) {
    positions[index].xyz = snapTiny(position);
  }
  velocities[index].xyz = snapTiny(velocity);
}
