#version 450
// SPDX-License-Identifier: MIT
// A floor with lines that fades into the background. In pass-through it only darkens the real floor.
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/colour.glsl"
#include "clients/xr/shaders/light.glsl"

layout(location = 0) in vec3 inPlace;
layout(location = 0) out vec4 outColour;

// Part of a pixel that a line covers; `halfWidth` and `spacing` are m.
float lines(vec2 place, float spacing, float halfWidth) {
  vec2 width = max(fwidth(place), vec2(1e-6));
  vec2 distance = abs(fract(place / spacing - 0.5) - 0.5) * spacing;
  vec2 covered =
      clamp((halfWidth - distance) / width + 0.5, 0.0, 1.0) * min(vec2(1.0), 2.0 * halfWidth / width + 0.15);
  return max(covered.x, covered.y);
}

void main() {
  vec3 eye = frame.eyes[gl_ViewIndex].xyz;
  float away = distance(inPlace.xz, frame.floorMiddle.xz) / frame.floorMiddle.w;
  float faded = smoothstep(0.15, 1.0, away);
  const vec3 up = vec3(0.0, 1.0, 0.0);
  if (frame.background == kBackgroundTransparent) {
    outColour = vec4(0.0, 0.0, 0.0, 0.42 * (1.0 - keyLit(inPlace, up)) * (1.0 - faded));
    return;
  }
  float spacing = frame.floorColour.w;
  float grid = max(0.6 * lines(inPlace.xz, spacing, 0.006 * spacing),
                   lines(inPlace.xz, 5.0 * spacing, 0.01 * spacing));
  Material m;
  m.colour = frame.floorColour.rgb * (1.0 - 0.45 * grid);
  m.roughness = 0.55;
  m.specular = vec3(0.04);
  m.sheen = vec3(0.0);
  m.sheenRoughness = 1.0;
  m.translucency = 0.0;
  m.reflection = 0.3;
  vec3 colour = toneMapped(shade(m, inPlace, up, up, eye));
  outColour = written(mix(colour, frame.outside.rgb, faded), 1.0);
}
