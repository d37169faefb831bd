#version 450
// SPDX-License-Identifier: MIT
// The panel and the names. Their texels are in sRGB encoding, multiplied with alpha.
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/colour.glsl"
#include "clients/xr/shaders/frame.glsl"

layout(set = 0, binding = kQuadsBinding, std430) readonly buffer Quads {
  QuadRecord quads[];
};
layout(set = 0, binding = kPanelBinding) uniform sampler2D panel;
layout(set = 0, binding = kLabelsBinding) uniform sampler2DArray labels;
layout(location = 0) in vec2 inPlace;
layout(location = 1) flat in uint inQuad;
layout(location = 0) out vec4 outColour;

void main() {
  QuadRecord quad = quads[inQuad];
  vec4 onPanel = texture(panel, inPlace);
  vec4 onLabel = texture(labels, vec3(inPlace, max(quad.look.x, 0.0)));
  vec4 texel = quad.look.x < 0.0 ? onPanel : onLabel;
  float alpha = texel.a * quad.middle.w;
  if (alpha <= 0.0) discard;
  outColour = written(srgbToLinear(clamp(texel.rgb / texel.a, 0.0, 1.0)), alpha);
}
