// SPDX-License-Identifier: MIT
// What the kernels that prepare a solve read, and how they list its chunks.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL

#include "shaders/solve/linear_system.glsl"

layout(binding = 3) uniform samplerBuffer positions;  // at the substep's start; w: inverse mass
// With kLimit: `freePositions`.
layout(binding = 4) uniform samplerBuffer velocities;  // at the substep's start
layout(binding = 5) uniform samplerBuffer freeVelocities;
layout(binding = 6) uniform samplerBuffer freePositions;  // with kPaper: `positions`
layout(std430, binding = 7) buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 8) buffer Actives {
  // Three numbers a chunk, group by group: its flags, then the active chunks of large systems, then the
  // prepared chunks.
  uint actives[];
};
layout(std430, binding = 9) buffer Groups {
  uint groups[];  // dispatch sizes, three numbers each: SolveStage
};

layout(push_constant) uniform Push {
  PreparePush push;
};

#include "shaders/solve/spring_weight.glsl"

End endAt(uint node) {
  vec4 position = texelFetch(positions, int(node));
  return End(position.xyz, position.w, kImplicit ? texelFetch(velocities, int(node)).xyz : vec3(0.0),
             texelFetch(freeVelocities, int(node)).xyz,
             kAdaptive ? texelFetch(freePositions, int(node)).xyz : vec3(0.0));
}

shared uint activeSprings, touched;

void beginChunk() {
  if (self() == 0) {
    activeSprings = touched = 0;
  }
  barrier();
}

// True if the round before solved the chunk. Such a chunk stays in the solve, because springs that are no
// longer active must give back what they did.
bool isContinued(System system, uint chunk) {
  return kLimit && push.round > 0 && (actives[system.firstChunk + chunk] & kActive) != 0;
}

// Stores whether a chunk has anything to solve, which follows from all of its nodes. Updates the dispatch
// sizes of the group: of the prepared chunks, of the small systems, of all chunks in the next round, of the
// active chunks of large systems. Chunks are listed in arbitrary order, because it does not matter which
// workgroup handles which chunk.
void keepActive(System system, uint chunk) {
  barrier();
  if (self() == 0) {
    uint place = system.firstChunk + chunk;
    bool before = kAdaptive && (actives[place] & kActive) != 0;
    bool continued = isContinued(system, chunk);
    bool active_ = touched != 0 || continued;
    actives[place] =
        (active_ ? kActive | kPrepared : 0) | (before ? kPrepared : 0) | (continued ? kContinued : 0);
    if (active_ || before) {
      uint listed = atomicAdd(groups[push.firstGroup], 1);
      actives[2 * (actives.length() / 3) + push.firstChunk + listed] = place;
    }
    if (active_) {
      atomicMax(groups[push.firstGroup + 6], push.chunks);
    }
    if (active_ && place < push.firstLargeChunk) {
      atomicMax(groups[push.firstGroup + 3], push.smallSystems);
    }
    if (active_ && place >= push.firstLargeChunk) {
      atomicAdd(solves[system.number].arrived, 0x10000);
      uint listed = atomicAdd(groups[push.firstGroup + 9], 1);
      actives[actives.length() / 3 + push.firstLargeChunk + listed] = place;
    }
  }
}

void keepActiveSprings(System system) {
  barrier();
  if (self() == 0 && activeSprings > 0) {
    atomicAdd(solves[system.number].constraints, activeSprings);
  }
}

#endif
