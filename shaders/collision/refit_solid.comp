// SPDX-License-Identifier: MIT
// Fits the boxes of a mesh's tree to the vertices that joints moved. A node has two boxes, which contain its
// triangles at the start and at the end of the tick. Each invocation handles the nodes below one node, from
// the lowest to that one. Writes cannot race: these nodes belong to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/collision/solid.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer table;  // the same memory as `solids`
layout(std430, binding = 1) buffer Solids {
  vec4 solids[];
};

layout(push_constant) uniform Push {
  RefitPush push;
};

const float kRounding = 4e-6;  // of a vertex and a box between the start and the end of the tick, per metre

struct Box {
  vec3 low;
  vec3 high;
};

void include_(inout Box box, vec3 point) {
  box.low = min(box.low, point);
  box.high = max(box.high, point);
}

// `when` is 0 at the start of the tick, 1 at its end.
Box boxOfLeaf(SolidRecord solid, uint leaf, int when) {
  Box box = Box(vec3(1e30), vec3(-1e30));
  uint leaves = uint(solid.leafCount), triangles = uint(solid.triangleCount);
  uint shift = uint(findMSB(leaves));
  uint last = ((leaf + 1u) * triangles) >> shift;
  for (uint t = (leaf * triangles) >> shift; t < last; ++t) {
    uvec3 corners = cornersAt(table, solid, t);
    for (uint corner = 0u; corner < 3u; ++corner) {
      int texel = int(uint(solid.firstVertex) + CLOTHSTREAM_MOVING_VERTEX_TEXELS * corners[corner]);
      include_(box, texelFetch(table, texel + CLOTHSTREAM_VERTEX_TEXELS * when).xyz);
    }
  }
  precise vec3 size = max(abs(box.low), abs(box.high));
  precise vec3 low = box.low - kRounding * size;
  precise vec3 high = box.high + kRounding * size;
  return Box(low, high);
}

void main() {
  if (gl_GlobalInvocationID.x >= push.rootCount) {
    return;
  }
  SolidRecord solid = solidRecordAt(table, push.solid);
  uint root = push.firstRoot + gl_GlobalInvocationID.x;
  uint first = uint(solid.firstBox), leaves = uint(solid.leafCount);
  for (uint level = push.levels; level > 0u; --level) {
    uint depth = level - 1u;
    uint end = (root + 1u) << depth;
    for (uint node = root << depth; node < end; ++node) {
      for (int when = 0; when < 2; ++when) {
        uint offset = first + CLOTHSTREAM_BOX_TEXELS * uint(when);
        uint texel = offset + CLOTHSTREAM_MOVING_BOX_TEXELS * node;
        Box box;
        if (node >= leaves) {
          box = boxOfLeaf(solid, node - leaves, when);
        } else {
          uint child = offset + CLOTHSTREAM_MOVING_BOX_TEXELS * 2u * node;
          uint other = child + CLOTHSTREAM_MOVING_BOX_TEXELS;
          box = Box(min(solids[child].xyz, solids[other].xyz),
                    max(solids[child + 1u].xyz, solids[other + 1u].xyz));
        }
        solids[texel] = vec4(box.low, 0.0);
        solids[texel + 1u] = vec4(box.high, 0.0);
      }
    }
  }
}
