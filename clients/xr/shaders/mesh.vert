#version 450
// SPDX-License-Identifier: MIT
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/frame.glsl"
#include "clients/xr/shaders/mesh.glsl"

layout(set = 0, binding = kNormalsBinding, std430) readonly buffer Normals {
  float normals[];
};
layout(location = 0) out vec3 outPlace;
layout(location = 1) out vec3 outNormal;
layout(location = 2) out vec2 outWeave;  // in tiles; 0 without a weave
layout(location = 3) flat out uint outPart;

void main() {
  VertexRecord vertex = vertices[gl_VertexIndex];
  mat4 model = parts[gl_InstanceIndex].model;
  vec4 place = model * vec4(positionOf(vertex.node), 1.0);
  uint n = 3 * vertex.node;
  outPlace = place.xyz;
  outNormal = mat3(model) * vec3(normals[n], normals[n + 1], normals[n + 2]);
  outWeave = vec2(vertex.u, vertex.v) * parts[gl_InstanceIndex].look.z;
  outPart = gl_InstanceIndex;
  gl_Position = frame.viewProjection[gl_ViewIndex] * place;
}
