#version 450
// SPDX-License-Identifier: MIT
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/frame.glsl"
#include "clients/xr/shaders/mesh.glsl"

void main() {
  vec4 place = parts[gl_InstanceIndex].model * vec4(positionOf(vertices[gl_VertexIndex].node), 1.0);
  vec4 coord = frame.shadow * place;
  gl_Position = vec4(2.0 * coord.xy - 1.0, coord.z, 1.0);
}
