// SPDX-License-Identifier: MIT
// Signed distances of a rigid mesh at the points of its grid, once. Each invocation has one point, and writes
// its distance into the texels of up to four points. No two invocations write the same number.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kSolidBinding = 0;

#include "shaders/collision/distance_grid.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 1) writeonly buffer Distances {
  float distances[];  // of the table of solids
};

layout(push_constant) uniform Push {
  SamplePush push;
};

const float kFar = 1e6;  // m

void main() {
  uint index = gl_GlobalInvocationID.x;
  SolidRecord solid = solidRecordAt(solids, push.solid);
  DistanceGrid grid = gridOf(solid);
  uint layer = grid.counts.x * grid.counts.y;
  if (index >= layer * grid.counts.z) {
    return;
  }
  uvec3 point = uvec3(index % grid.counts.x, index / grid.counts.x % grid.counts.y, index / layer);
  precise vec3 place = grid.origin + grid.cell * vec3(point);
  float distance_ = nearestOnSolid(solid, 0.0, place, kFar).distance;
  for (uint i = 0u; i < 4u; ++i) {
    uvec3 back = uvec3(0u, i % 2u, i / 2u);
    if (point.y >= back.y && point.z >= back.z) {
      distances[4u * distanceTexel(grid, point - back) + i] = distance_;
    }
  }
}
