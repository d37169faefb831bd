// SPDX-License-Identifier: MIT
// What conjugate gradients start with at each node of meshes, from their springs. One chunk a workgroup;
// every node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/spring_terms.glsl"

layout(binding = 10) uniform samplerBuffer incidences;  // IncidenceRecord, a node
layout(binding = 11) uniform samplerBuffer lists;       // SpringEndsRecord
layout(binding = 12) uniform samplerBuffer rows;        // prepare_springs.comp
layout(binding = 13) uniform samplerBuffer impulses;
layout(std430, binding = 14) writeonly buffer Vectors {
  vec4 vectors[];
};

void prepareNode(System system, uint node, float compliance, bool stored) {
  precise vec3 impulse = vec3(0.0);
  precise float trace = 0.0;
  uint active_ = 0;  // counted at the spring's first end
  bool any = false;
  vec4 list = texelFetch(incidences, int(node));
  int texel = int(wholeNumber(list.x, list.y));
  int end = texel + int(list.z);
  while (texel < end) {
    vec4 two = texelFetch(lists, texel);
    [[unroll]] for (int k = 0; k < 4; k += 2) {
      float number = two[k];
      int spring = int(system.firstSpring + uint(max(abs(number), 1.0)) - 1);
      vec4 row = texelFetch(rows, spring);
      vec3 push_ = texelFetch(impulses, spring).xyz;
      precise float square = dotProduct(row.xyz, row.xyz) + 3.0 * row.w;
      impulse = impulse + (number > 0.0 ? push_ : (number < 0.0 ? -push_ : vec3(0.0)));
      trace = trace + (number == 0.0 ? 0.0 : square);
      any = any || (number != 0.0 && square > 0.0);
      active_ += number > 0.0 && square > 0.0 ? 1 : 0;
    }
    ++texel;
  }
  Start start = startOf(endAt(node), impulse, trace, compliance);
  if (stored) {
    vectors[kResiduals * push.nodes + node] = start.residual;
    vectors[kCorrections * push.nodes + node] = vec4(start.correction, 0.0);
    if (kImplicit || any) {
      atomicOr(touched, 1);
    }
    if (!kImplicit) {
      atomicAdd(activeSprings, active_);
    }
  }
}

void main() {
  vec4 part = texelFetch(chunks, int(push.firstChunk + gl_WorkGroupID.x));
  System system = systemAt(uint(part.x));
  uint chunk = uint(part.y);
  float compliance = texelFetch(cloths, system.cloth + 5).x;
  beginChunk();
  uint lane = self();
  do {
    Walk walk = walkAt(system, chunk * kLanes + lane);
    uint k = 0;
    do {
      prepareNode(system, walk.first + min(k, max(walk.count, 1) - 1), compliance, k < walk.count);
      ++k;
    } while (k < kWalk);
    lane += width();
  } while (lane < kLanes);
  keepActive(system, chunk);
  keepActiveSprings(system);
}
