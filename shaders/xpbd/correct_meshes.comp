// SPDX-License-Identifier: MIT
// Corrects the springs of meshes colour by colour. Writes cannot race: no two springs of a colour share a
// node. A workgroup handles its part of one colour, or all colours of a whole cloth with barriers between;
// the bits are the same.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/xpbd/spring.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 3) const bool kWhole = true;
// True: nodes are read from storage, which suits GPUs. The bits are the same.
layout(constant_id = 4) const bool kReadsStorage = true;

layout(binding = 0) uniform samplerBuffer cloths;          // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;           // XpbdMeshTile
layout(binding = 2) uniform samplerBuffer startPositions;  // at the substep's start
// The same memory twice: a software device reads texels three times as fast as storage and writes storage
// five times as fast as texels.
layout(binding = 3, rgba32f) uniform coherent readonly imageBuffer nodeTexels;
layout(std430, binding = 4) buffer Positions {
  vec4 positions[];  // w: inverse mass
};
layout(std430, binding = 5) buffer Multipliers {
  float multipliers[];
};
layout(binding = 6) uniform samplerBuffer colours;  // ColourRecord
layout(binding = 7) uniform samplerBuffer links;    // XpbdLinkRecord

layout(push_constant) uniform Push {
  XpbdPush push;
};

vec4 fetchNode(int index) {
  return kReadsStorage ? positions[index] : imageLoad(nodeTexels, index);
}

void correct(uint link, uint cloth, bool again) {
  XpbdLinkRecord record = xpbdLinkAt(links, link);
  int a = int(record.a);
  int b = int(record.b);
  Spring spring = springFrom(xpbdSpringAt(cloths, cloth, uint(record.kind)), record.restLength);
  vec4 nodeA = fetchNode(a);
  vec4 nodeB = fetchNode(b);
  precise vec3 d = nodeB.xyz - nodeA.xyz;
  precise vec3 begun = texelFetch(startPositions, b).xyz - texelFetch(startPositions, a).xyz;
  precise float inverseMasses = nodeA.w + nodeB.w;
  float multiplier = 0.0;
  if (kIterated && again) {
    multiplier = multipliers[push.firstMultiplier + link];
  }
  vec3 pull = pullOf(d, begun, nodeA.xyz, spring, inverseResistance(spring, inverseMasses), multiplier);
  if (kIterated) {
    multipliers[push.firstMultiplier + link] = multiplier;
  }
  precise vec3 movedA = nodeA.xyz - nodeA.w * pull;
  precise vec3 movedB = nodeB.xyz + nodeB.w * pull;
  positions[a].xyz = snapTiny(movedA);
  positions[b].xyz = snapTiny(movedB);
}

void correctCloth() {
  XpbdMeshTile tile = xpbdMeshTileAt(tiles, push.firstTile + gl_WorkGroupID.x);
  uint cloth = uint(tile.cloth);
  uint endIteration = min(uint(clothAt(cloths, cloth).solverIterations), push.endIteration);
  uint iteration = push.firstIteration;
  if (iteration >= endIteration) {
    return;
  }
  // There is at least one colour, and each colour has at least one spring.
  do {
    uint colour = uint(tile.firstColour);
    do {
      ColourRecord springs = colourAt(colours, colour);
      uint first = uint(springs.firstSpringLow) + (uint(springs.firstSpringHigh) << 24);
      uint count = uint(springs.springCount);
      uint i = gl_LocalInvocationID.x;
      uint rounds = (count + gl_WorkGroupSize.x - 1) / gl_WorkGroupSize.x;
      do {
        if (i < count) {
          correct(first + i, cloth, iteration > 0);
        }
        i += gl_WorkGroupSize.x;
        --rounds;
      } while (rounds > 0);
      memoryBarrier();
      barrier();
      ++colour;
    } while (colour < uint(tile.firstColour) + uint(tile.colourCount));
    ++iteration;
  } while (iteration < endIteration);
}

void main() {
  if (kWhole) {
    correctCloth();
  } else if (gl_GlobalInvocationID.x < push.springs) {
    correct(push.firstSpring + gl_GlobalInvocationID.x, push.cloth, push.firstIteration > 0);
  }
}
