// SPDX-License-Identifier: MIT
// Computes the start of conjugate gradients at each node of meshes from the terms of its springs. A workgroup
// handles one chunk; every node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/spring_terms.glsl"

layout(binding = 10) uniform samplerBuffer incidences;  // ListRecord by node
layout(binding = 11) uniform samplerBuffer lists;       // SpringEndsRecord
layout(binding = 12) uniform samplerBuffer rows;        // WeightedSpring
layout(binding = 13) uniform samplerBuffer impulses;
layout(std430, binding = 14) buffer Vectors {
  vec4 vectors[];
};

void prepareNode(System system, uint node, float compliance, bool stored, bool continued) {
  precise vec3 impulse = vec3(0.0);
  uint active_ = 0;  // counted at the spring's first end
  bool any = false;
  TexelRange list = rangeOf(listAt(incidences, node));
  while (list.first < list.end) {
    SpringEndsRecord two = springEndsAt(lists, list.first);
    [[unroll]] for (int k = 0; k < 2; ++k) {
      float number = two.ends[k].signedSpring;
      uint spring = system.firstSpring + uint(max(abs(number), 1.0)) - 1;
      WeightedSpring weighted = weightedSpringAt(rows, spring);
      vec3 push_ = texelFetch(impulses, int(spring)).xyz;
      precise float square = dotProduct(weighted.row, weighted.row) + 3.0 * weighted.across;
      impulse = impulse + (number > 0.0 ? push_ : (number < 0.0 ? -push_ : vec3(0.0)));
      any = any || (number != 0.0 && square > 0.0);
      active_ += number > 0.0 && square > 0.0 ? 1 : 0;
    }
    ++list.first;
  }
  vec3 total = kLimit && continued ? vectors[kTotals * push.nodes + node].xyz : vec3(0.0);
  Start start = startOf(endAt(node), impulse, compliance, total);
  if (stored) {
    vectors[kResiduals * push.nodes + node] = start.residual;
    vectors[kCorrections * push.nodes + node] = vec4(start.correction, 0.0);
    if (kLimit) {
      vectors[kTotals * push.nodes + node] = vec4(total, 0.0);
    }
    if (kImplicit || any) {
      atomicOr(touched, 1);
    }
    if (!kImplicit) {
      atomicAdd(activeSprings, active_);
    }
  }
}

void main() {
  ChunkRecord part = chunkAt(chunks, push.firstChunk + gl_WorkGroupID.x);
  System system = systemAt(uint(part.system));
  uint chunk = uint(part.chunk);
  float compliance = clothAt(cloths, system.cloth).scaledCompliance;
  bool continued = isContinued(system, chunk);
  beginChunk();
  uint lane = self();
  do {
    Walk walk = walkAt(system, chunk * kLanes + lane);
    uint k = 0;
    do {
      prepareNode(system, walk.first + min(k, max(walk.count, 1) - 1), compliance, k < walk.count, continued);
      ++k;
    } while (k < kWalk);
    lane += width();
  } while (lane < kLanes);
  keepActive(system, chunk);
  keepActiveSprings(system);
}
