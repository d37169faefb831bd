// SPDX-License-Identifier: MIT
// Lists the pairs of triangles whose boxes overlap. The first one of a pair has the lower number.
//
// The order of the pairs is arbitrary, and does not change the result: minima and sums of integers. If there
// are more than the list holds, their number says so. It also says so if the searches visit too many boxes,
// one alone or all together: the numbers of visits do not depend on the order either, as long as nothing
// stops. The searches then stop, because the list is of no use.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/motion_bound/motion_bound.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer faces;  // FaceRecord
layout(std430, binding = 1) readonly buffer Boxes {
  vec4 boxes[];
};
layout(std430, binding = 2) writeonly buffer Pairs {
  uvec2 pairs[];
};
layout(std430, binding = 3) coherent buffer Groups {
  PairCounts counts;
  uint sizes[];
};

layout(push_constant) uniform Push {
  PairPush push;
};

// One loop, without an inner search for the next triangle: lavapipe of Mesa 22.3 leaves nested do-while loops
// too early. A loop that runs at most once is a branch that lavapipe skips if no invocation takes it.
void main() {
  uint face = gl_GlobalInvocationID.x;
  if (face >= push.faceCount) {
    return;
  }
  uint own = uint(faceAt(faces, face).box);
  vec3 low = boxes[CLOTHSTREAM_TREE_BOX_TEXELS * own].xyz;
  vec3 high = boxes[CLOTHSTREAM_TREE_BOX_TEXELS * own + 1].xyz;
  uint visits = 0;
  for (uint box = 0; box < push.boxCount;) {
    vec4 otherLow = boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box];
    vec4 otherHigh = boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box + 1];
    bool meets = all(lessThanEqual(low, otherHigh.xyz)) && all(greaterThanEqual(high, otherLow.xyz));
    box = meets ? box + 1 : uint(otherLow.w);
    for (bool found = meets && otherHigh.w > float(face); found; found = false) {
      uint place = atomicAdd(counts.count, 1u);
      if (place < push.facePairs) {
        pairs[place] = uvec2(face, uint(otherHigh.w));
        atomicMax(sizes[3 * (place / kPartPairs)], place % kPartPairs / gl_WorkGroupSize.x + 1);
      }
    }
    ++visits;
    for (bool full = visits % kVisitBlock == 0; full; full = false) {
      bool stops = atomicAdd(counts.visits, 1u) >= push.visits || visits >= kMostVisits;
      if (stops) {
        atomicMax(counts.count, push.facePairs + 1);
      }
      if (stops || counts.count > push.facePairs) {
        box = push.boxCount;
      }
    }
  }
}
