#version 450
// SPDX-License-Identifier: MIT
// The bright room behind everything.
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/colour.glsl"
#include "clients/xr/shaders/frame.glsl"

layout(location = 0) in vec2 inPlace;
layout(location = 0) out vec4 outColour;

void main() {
  vec4 far = frame.unproject[gl_ViewIndex] * vec4(inPlace, 1.0, 1.0);
  vec3 direction = normalize(far.xyz / far.w - frame.eyes[gl_ViewIndex].xyz);
  vec3 colour = mix(frame.outside.rgb, frame.zenith.rgb, smoothstep(0.0, 0.6, direction.y));
  outColour = written(colour, 1.0);
}
