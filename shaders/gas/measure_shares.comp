// SPDX-License-Identifier: MIT
// Computes what each node of a cloth with gas contributes: the gradient of the volume by its place, to the
// volume at the substep's start, to the growth of the volume by the free motion, and to the response to
// pressure (model/gas.h).
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/gas/gas.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/mesh.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer meshNodes;        // MeshNodeRecord, of closed meshes
layout(binding = 1) uniform samplerBuffer triangleCorners;  // CornerPairRecord
layout(binding = 2) uniform samplerBuffer startPositions;   // w: inverse mass
layout(binding = 3) uniform samplerBuffer freePositions;
layout(std430, binding = 4) writeonly buffer Shares {
  vec4 shares[];
};

layout(push_constant) uniform Push {
  GasPush push;
};

vec3 startOf(float node) {
  return texelFetch(startPositions, int(node)).xyz;
}

// Twice the area vector of a triangle.
vec3 doubleArea(vec3 here, OtherCorners others) {
  precise vec3 second = startOf(others.second) - here;
  precise vec3 third = startOf(others.third) - here;
  return crossProduct(second, third);
}

// Writes cannot race: each node belongs to one invocation.
void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodeCount) {
    return;
  }
  uint record = push.firstRecord + node;
  vec4 start = texelFetch(startPositions, int(push.firstNode + node));
  vec3 free = texelFetch(freePositions, int(push.firstNode + node)).xyz;
  TexelRange triangles = rangeOf(meshNodeAt(meshNodes, record).triangles);
  precise vec3 sum = vec3(0.0);
  while (triangles.first < triangles.end) {
    OtherCorners pair[2] = cornerPairAt(triangleCorners, triangles.first).triangles;
    sum = sum + doubleArea(start.xyz, pair[0]);
    sum = sum + doubleArea(start.xyz, pair[1]);
    ++triangles.first;
  }
  precise vec3 gradient = (1.0 / 6.0) * sum;
  // Places are relative to the cloth's first node.
  precise vec3 place = start.xyz - startOf(float(push.firstNode));
  precise vec3 way = free - start.xyz;
  precise float volume = dotProduct(place, gradient) * (push.perVolume * (1.0 / 3.0));
  precise float growth = dotProduct(way, gradient) * push.perVolume;
  precise float response = dotProduct(gradient, gradient) * (start.w * push.response);
  shares[CLOTHSTREAM_GAS_SHARE_TEXELS * record] = vec4(snapTiny(gradient), 0.0);
  shares[CLOTHSTREAM_GAS_SHARE_TEXELS * record + 1] = vec4(snapTiny(vec3(volume, growth, response)), 0.0);
}
