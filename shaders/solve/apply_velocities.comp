// SPDX-License-Identifier: MIT
// Adds the solution to the free motion of every node; then the node collides. A workgroup handles one chunk;
// every node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 4;
const int kStateBinding = 6;
const int kContactImpulseBinding = 10;

#include "shaders/solve/linear_system.glsl"
// This header reads the table `cloths`, which linear_system.glsl declares.
#include "shaders/shared/end_of_substep.glsl"

layout(binding = 3) uniform samplerBuffer vectors;

layout(std430, binding = 9) readonly buffer Actives {
  uint actives[];  // spring_terms.glsl
};

layout(std430, binding = 11) readonly buffer Groups {
  uint groups[];  // dispatch sizes
};

layout(push_constant) uniform Push {
  ApplyPush push;
};

void main() {
  uint place = push.firstChunk + gl_WorkGroupID.x;
  if (push.listed != 0) {
    place = actives[2 * (actives.length() / 3) + place];
  }
  ChunkRecord part = chunkAt(chunks, place);
  System system = systemAt(uint(part.system));
  // Without any prepared chunk the flags are those of an earlier substep.
  bool solved = groups[push.firstGroup] != 0 && (actives[place] & kActive) != 0;
  uint lane = self();
  do {
    Walk walk = walkAt(system, uint(part.chunk) * kLanes + lane);
    uint k = 0;
    do {
      if (k < walk.count) {
        uint node = walk.first + k * walk.step;
        vec4 fetched = texelFetch(vectors, int(kCorrections * push.nodes + node));
        vec3 correction = solved ? fetched.xyz : vec3(0.0);
        precise vec3 position = positions[node].xyz + push.substepSeconds * correction;
        precise vec3 velocity = velocities[node].xyz + correction;
        endSubstep(node, position, velocity, positions[node].w, system.cloth, push.collision);
      }
      ++k;
    } while (k < kWalk);
    lane += width();
  } while (lane < kLanes);
}
