// SPDX-License-Identifier: MIT
// Vertex normals of every mesh of a scene: the sum of the area vectors of a node's triangles.
#version 450
#extension GL_GOOGLE_include_directive : require

#define CLOTHSTREAM_MESH_BINDING 4

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/mesh_node.glsl"

layout(binding = 2) uniform samplerBuffer positions;
layout(std430, binding = 3) writeonly buffer Normals {
  vec4 normals[];
};

vec3 fetchPosition(uint index) {
  return texelFetch(positions, int(index)).xyz;
}

// Twice the area vector of a triangle.
vec3 areaOf(vec3 here, OtherCorners others) {
  precise vec3 toSecond = fetchPosition(uint(others.second)) - here;
  precise vec3 toThird = fetchPosition(uint(others.third)) - here;
  return crossProduct(toSecond, toThird);
}

// Writes cannot race: each node belongs to one invocation.
void main() {
  MeshNode self = locateMeshNode(0);
  if (!self.exists) {
    return;
  }
  vec3 here = fetchPosition(self.index);
  precise vec3 sum = vec3(0.0);
  TexelRange triangles = trianglesOf(self);
  while (triangles.first < triangles.end) {
    CornerPairRecord pair = cornerPairAt(triangleCorners, triangles.first);
    sum = sum + areaOf(here, pair.triangles[0]);
    sum = sum + areaOf(here, pair.triangles[1]);
    ++triangles.first;
  }
  precise float squared = dotProduct(sum, sum);
  precise vec3 normal = squared < 1e-30 ? vec3(0.0, 0.0, 1.0) : sum * reciprocalSquareRoot(squared);
  normals[self.index] = vec4(snapTiny(normal), 0.0);
}
