// SPDX-License-Identifier: MIT
// Moves the vertices of a mesh by its joints: linear blend skinning, to the start and to the end of the tick.
// Writes cannot race: each vertex belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/collision/solid.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer rests;       // SkinVertexRecord
layout(binding = 1) uniform samplerBuffer transforms;  // rows of all joints at the start, then at the end
layout(std430, binding = 2) writeonly buffer Solids {
  vec4 solids[];
};

layout(push_constant) uniform Push {
  SkinPush push;
};

vec3 moved(int joint, vec4 point) {
  int texel = CLOTHSTREAM_TRANSFORM_TEXELS * joint;
  vec4 x = texelFetch(transforms, texel), y = texelFetch(transforms, texel + 1),
       z = texelFetch(transforms, texel + 2);
  precise vec3 sum = vec3(dotProduct(x.xyz, point.xyz) + x.w, dotProduct(y.xyz, point.xyz) + y.w,
                          dotProduct(z.xyz, point.xyz) + z.w);
  return sum;
}

void main() {
  uint vertex = gl_GlobalInvocationID.x;
  if (vertex >= push.vertexCount) {
    return;
  }
  int rest = int(push.firstRest + CLOTHSTREAM_SKIN_VERTEX_TEXELS * vertex);
  vec4 point = texelFetch(rests, rest);
  vec4 joints = texelFetch(rests, rest + 1);
  vec4 weights = texelFetch(rests, rest + 2);
  for (uint end = 0u; end < 2u; ++end) {
    int first = int(push.firstJoint + end * push.jointCount);
    precise vec3 sum = vec3(0.0);
    for (uint k = 0u; k < 4u; ++k) {
      sum = sum + weights[k] * moved(first + int(joints[k]), point);
    }
    solids[push.firstVertex + CLOTHSTREAM_MOVING_VERTEX_TEXELS * vertex + 2u * end] = vec4(sum, 0.0);
  }
}
