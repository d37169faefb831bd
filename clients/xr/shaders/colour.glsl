// SPDX-License-Identifier: MIT
// Tone mapping and encoding of colours.
#include "clients/xr/shaders/frame.glsl"

// AgX (Sobotka 2023), as three.js has it for the page.
vec3 toneMapped(vec3 colour) {
  const mat3 toRec2020 = mat3(0.6274, 0.0691, 0.0164, 0.3293, 0.9195, 0.0880, 0.0433, 0.0113, 0.8956);
  const mat3 fromRec2020 = mat3(1.6605, -0.1246, -0.0182, -0.5876, 1.1329, -0.1006, -0.0728, -0.0083, 1.1187);
  const mat3 inset =
      mat3(0.856627153315983, 0.137318972929847, 0.11189821299995, 0.0951212405381588, 0.761241990602591,
           0.0767994186031903, 0.0482516061458583, 0.101439036467562, 0.811302368396859);
  const mat3 outset = mat3(1.1271005818144368, -0.1413297634984383, -0.14132976349843826,
                           -0.11060664309660323, 1.157823702216272, -0.11060664309660294,
                           -0.016493938717834573, -0.016493938717834257, 1.2519364065950405);
  const float least = -12.47393;
  const float most = 4.026069;
  vec3 x = inset * (toRec2020 * (colour * frame.exposure));
  x = clamp((log2(max(x, vec3(1e-10))) - least) / (most - least), 0.0, 1.0);
  vec3 x2 = x * x;
  vec3 x4 = x2 * x2;
  x = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
  x = pow(max(outset * x, vec3(0.0)), vec3(2.2));
  return clamp(fromRec2020 * x, 0.0, 1.0);
}

vec3 srgbToLinear(vec3 encoded) {
  return mix(encoded / 12.92, pow((encoded + 0.055) / 1.055, vec3(2.4)), greaterThan(encoded, vec3(0.04045)));
}

vec3 linearToSrgb(vec3 linear) {
  return mix(12.92 * linear, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055,
             greaterThan(linear, vec3(0.0031308)));
}

// What a fragment writes: a linear colour between 0 and 1, multiplied with alpha.
vec4 written(vec3 colour, float alpha) {
  vec3 encoded = frame.encodes != 0 ? linearToSrgb(colour) : colour;
  return vec4(encoded * alpha, alpha);
}
