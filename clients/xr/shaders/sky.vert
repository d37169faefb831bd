#version 450
// SPDX-License-Identifier: MIT
// One triangle that covers the picture, at the far plane.
layout(location = 0) out vec2 outPlace;

void main() {
  outPlace = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
  gl_Position = vec4(outPlace, 1.0, 1.0);
}
