// SPDX-License-Identifier: MIT
// Computes the box that contains a triangle during the substep, in whatever direction its nodes move. Writes
// cannot race: each leaf belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kStartBinding = 1;

#include "shaders/motion_bound/moving_node.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer faces;  // FaceRecord
layout(std430, binding = 3) writeonly buffer Boxes {
  vec4 boxes[];
};

layout(push_constant) uniform Push {
  TreePush push;
};

void main() {
  uint face = gl_GlobalInvocationID.x;
  if (face >= push.count) {
    return;
  }
  FaceRecord record = faceAt(faces, face);
  Moving a = movingNode(uint(record.corners.x));
  Moving b = movingNode(uint(record.corners.y));
  Moving c = movingNode(uint(record.corners.z));
  precise float reach = max(a.way, max(b.way, c.way)) + 0.5 * push.gap;
  precise vec3 low = min(a.at, min(b.at, c.at)) - reach;
  precise vec3 high = max(a.at, max(b.at, c.at)) + reach;
  uint box = uint(record.box);
  boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box] = vec4(low, float(box + 1));
  boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box + 1] = vec4(high, float(face));
}
