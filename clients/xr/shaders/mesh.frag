#version 450
// SPDX-License-Identifier: MIT
// Cloth with two sides, weave, sheen and light that shines through; and hulls.
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/colour.glsl"
#include "clients/xr/shaders/light.glsl"
#include "clients/xr/shaders/mesh.glsl"

layout(set = 0, binding = kWeaveColoursBinding) uniform sampler2DArray weaveColours;
layout(set = 0, binding = kWeaveReliefsBinding) uniform sampler2DArray weaveReliefs;
layout(location = 0) in vec3 inPlace;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec2 inWeave;
layout(location = 3) flat in uint inPart;
layout(location = 0) out vec4 outColour;

// A normal of a texture, turned from the tangents of the surface to the scene (Mikkelsen 2020).
vec3 bent(vec3 n, vec2 relief, vec2 uv) {
  vec3 px = dFdx(inPlace), py = dFdy(inPlace);
  vec2 tx = dFdx(uv), ty = dFdy(uv);
  vec3 q1 = cross(py, n), q0 = cross(n, px);
  vec3 t = q1 * tx.x + q0 * ty.x;
  vec3 b = q1 * tx.y + q0 * ty.y;
  float longest = max(dot(t, t), dot(b, b));
  if (longest == 0.0) return n;
  // Rows of the picture go down, so derivatives along them turn both tangents around.
  float side = gl_FrontFacing ? -1.0 : 1.0;
  return normalize(n + side * inversesqrt(longest) * (relief.x * t + relief.y * b));
}

void main() {
  PartRecord part = parts[inPart];
  vec3 flatNormal = normalize(cross(dFdy(inPlace), dFdx(inPlace)));
  vec3 eye = frame.eyes[gl_ViewIndex].xyz;
  flatNormal = faceforward(flatNormal, inPlace - eye, flatNormal);
  vec3 normal = part.faceted != 0 ? flatNormal : normalize(inNormal);
  if (part.faceted == 0 && !gl_FrontFacing) normal = -normal;

  Material m;
  m.colour = part.colour.rgb;
  m.roughness = part.colour.w;
  // Threads reflect in their own colour, in addition to the white reflection of their surface.
  m.specular = 0.04 * mix(part.colour.rgb, vec3(1.0), 0.4);
  m.sheen = part.sheen.x * mix(part.colour.rgb, vec3(1.0), 0.2);
  m.sheenRoughness = part.sheen.y;
  m.translucency = part.sheen.w;
  m.reflection = part.look.y;
  // Derivatives are those of inputs alone. Mesa's software device reads zeros from buffers in helper
  // invocations, so that derivatives of anything else are wrong in quads at edges of triangles, and in
  // branches on it.
  vec4 threads = texture(weaveColours, vec3(inWeave, part.look.w));
  vec4 relief = texture(weaveReliefs, vec3(inWeave, part.look.w));
  vec3 shaded = bent(normal, part.look.x * (2.0 * relief.xy - 1.0), inWeave);
  if (part.look.z > 0.0) {
    // A texel of 200 in sRGB encoding leaves the colour as it is.
    m.colour *= threads.rgb * 1.706;
    m.roughness *= relief.w;
  }
  if (!gl_FrontFacing) m.colour *= part.sheen.z;
  m.colour = min(m.colour, vec3(0.95));
  outColour = written(toneMapped(shade(m, inPlace, shaded, normal, eye)), 1.0);
}
