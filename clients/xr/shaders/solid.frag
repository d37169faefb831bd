#version 450
// SPDX-License-Identifier: MIT
// Colliders and people. What a collider is made of is computed from its own coordinates.
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/colour.glsl"
#include "clients/xr/shaders/light.glsl"

layout(set = 0, binding = kSolidsBinding, std430) readonly buffer Solids {
  SolidRecord solids[];
};
layout(location = 0) in vec3 inPlace;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec3 inLocal;
layout(location = 3) flat in uint inSolid;
layout(location = 0) out vec4 outColour;

// Values of Substance.
const uint kCeramic = 1;
const uint kWood = 2;
const uint kPlaster = 3;
const uint kStone = 4;
const uint kGlowing = 5;

float hash(vec3 p) {
  uvec3 q = uvec3(ivec3(p)) * uvec3(1597334673u, 3812015801u, 2798796415u);
  uint n = (q.x ^ q.y ^ q.z) * 1597334673u;
  return float(n >> 8) / 16777216.0;
}

float noise(vec3 p) {
  vec3 i = floor(p);
  vec3 f = p - i;
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(mix(hash(i), hash(i + vec3(1, 0, 0)), f.x),
                 mix(hash(i + vec3(0, 1, 0)), hash(i + vec3(1, 1, 0)), f.x), f.y),
             mix(mix(hash(i + vec3(0, 0, 1)), hash(i + vec3(1, 0, 1)), f.x),
                 mix(hash(i + vec3(0, 1, 1)), hash(i + vec3(1, 1, 1)), f.x), f.y),
             f.z);
}

vec3 textured(uint substance, vec3 colour) {
  vec3 p = inLocal;
  if (substance == kWood) {
    float rings = length(p.xz) * 260.0 + 5.0 * noise(p * vec3(14.0, 3.0, 14.0));
    float grain = noise(p * vec3(220.0, 9.0, 220.0));
    return colour * (0.82 + 0.22 * (0.5 + 0.5 * sin(rings)) + 0.22 * grain);
  }
  if (substance == kPlaster) return colour * (0.95 + 0.06 * noise(p * 9.0) + 0.04 * noise(p * 70.0));
  if (substance == kStone) return colour * (0.8 + 0.25 * noise(p * 22.0) + 0.18 * noise(p * 140.0));
  return colour;
}

void main() {
  SolidRecord solid = solids[inSolid];
  float opacity = solid.position.w;
  if (opacity < 0.0) {
    outColour = vec4(0.0);
    return;
  }
  uint substance = floatBitsToUint(solid.stretch.w);
  if (substance == kGlowing) {
    outColour = written(solid.colour.rgb, opacity);
    return;
  }
  vec3 eye = frame.eyes[gl_ViewIndex].xyz;
  vec3 n = normalize(inNormal);
  n = faceforward(n, inPlace - eye, n);
  Material m;
  m.colour = textured(substance, solid.colour.rgb);
  m.roughness = solid.colour.w;
  m.specular = vec3(0.04);
  m.sheen = vec3(0.0);
  m.sheenRoughness = 1.0;
  m.translucency = 0.0;
  m.reflection = solid.more.x;
  outColour = written(toneMapped(shade(m, inPlace, n, n, eye)), opacity);
}
