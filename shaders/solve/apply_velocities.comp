// SPDX-License-Identifier: MIT
// What was solved for takes every node of its cloths from where the forces alone took it; then it collides.
// One chunk a workgroup; every node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 4;
const int kStateBinding = 6;
const int kContactImpulseBinding = 10;

#include "shaders/solve/linear_system.glsl"
// Reads `cloths`.
#include "shaders/shared/end_of_substep.glsl"

layout(binding = 3) uniform samplerBuffer vectors;

layout(std430, binding = 9) readonly buffer Actives {
  uint actives[];  // a chunk: kActive
};

layout(push_constant) uniform Push {
  ApplyPush push;
};

void main() {
  vec4 part = texelFetch(chunks, int(push.firstChunk + gl_WorkGroupID.x));
  System system = systemAt(uint(part.x));
  bool solved = (actives[system.firstChunk + uint(part.y)] & kActive) != 0;
  uint lane = self();
  do {
    Walk walk = walkAt(system, uint(part.y) * kLanes + lane);
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
