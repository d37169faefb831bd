#version 450
// SPDX-License-Identifier: MIT
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/frame.glsl"

layout(location = 0) out vec3 outPlace;

void main() {
  const vec2 corners[6] =
      vec2[](vec2(-1.0), vec2(1.0), vec2(1.0, -1.0), vec2(-1.0), vec2(-1.0, 1.0), vec2(1.0));
  vec2 corner = corners[gl_VertexIndex] * frame.floorMiddle.w;
  outPlace = frame.floorMiddle.xyz + vec3(corner.x, 0.0, corner.y);
  gl_Position = frame.viewProjection[gl_ViewIndex] * vec4(outPlace, 1.0);
}
