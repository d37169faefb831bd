#version 450
// SPDX-License-Identifier: MIT
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/frame.glsl"
#include "clients/xr/shaders/solid.glsl"

void main() {
  SolidRecord solid = solids[gl_InstanceIndex];
  vec4 coord = frame.shadow * vec4(placeOf(solid, vertexOf(solid, gl_VertexIndex).local), 1.0);
  gl_Position = vec4(2.0 * coord.xy - 1.0, coord.z, 1.0);
}
