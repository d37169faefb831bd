#version 450
// SPDX-License-Identifier: MIT
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/frame.glsl"

layout(set = 0, binding = kQuadsBinding, std430) readonly buffer Quads {
  QuadRecord quads[];
};
layout(location = 0) out vec2 outPlace;
layout(location = 1) flat out uint outQuad;

void main() {
  const vec2 corners[6] =
      vec2[](vec2(-1.0), vec2(1.0, -1.0), vec2(1.0), vec2(-1.0), vec2(1.0), vec2(-1.0, 1.0));
  QuadRecord quad = quads[gl_InstanceIndex];
  vec2 corner = corners[gl_VertexIndex];
  outPlace = vec2(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y) * vec2(quad.right.w, quad.up.w);
  outQuad = gl_InstanceIndex;
  vec3 place = quad.middle.xyz + corner.x * quad.right.xyz + corner.y * quad.up.xyz;
  gl_Position = frame.viewProjection[gl_ViewIndex] * vec4(place, 1.0);
}
