// SPDX-License-Identifier: MIT
// Light on a surface: key light with a soft shadow, rim light, and the surroundings without images.
#include "clients/xr/shaders/frame.glsl"

const float kPi = 3.14159265;

layout(set = 0, binding = kShadowDepthsBinding) uniform sampler2D shadowDepths;
layout(set = 0, binding = kShadowBinding) uniform sampler2DShadow shadowMap;

// 1: shadows are softer with the distance from what casts them.
layout(constant_id = 0) const uint kFullShadows = 1;

// Percentage-closer soft shadows (Fernando 2005), with the numbers of the page
// (clients/web/page/src/soft_shadow.ts).
const float kTexels = 2048.0;
const float kDepthPerWidth = 3.2 / 8.0;
const float kSteepest = 6.0 * kDepthPerWidth;
const float kCurvature = 0.9 * kDepthPerWidth;
const float kUvPerDepth = 0.14 / 2.0 / kDepthPerWidth;
const float kSearchDepth = 0.25;
const int kSearchSamples = 10;
const int kFilterSamples = 14;
const int kCheapSamples = 5;
const float kCheapRadius = 3.5 / kTexels;

vec2 diskSample(int index, int count, float turn) {
  float angle = float(index) * 2.399963 + turn;
  return sqrt((float(index) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}

// Part of a disk of the map that does not shade the surface.
float litPart(vec3 coord, vec2 slope, float turn, float radius, int samples) {
  float lit = 0.0;
  for (int i = 0; i < samples; ++i) {
    vec2 offset = radius * diskSample(i, samples, turn);
    lit += texture(shadowMap,
                   vec3(coord.xy + offset, coord.z + dot(slope, offset) - kCurvature * length(offset)));
  }
  return lit / float(samples);
}

// Light of the key light that arrives, 0 to 1. `normal` is that of the geometry, on the side of the viewer.
float keyLit(vec3 place, vec3 normal) {
  vec3 offset = faceforward(normal, -frame.keyDirection.xyz, normal) * frame.keyLight.w;
  vec3 coord = (frame.shadow * vec4(place + offset, 1.0)).xyz;
  // Slope of depth along the surface in map coordinates. It prevents inclined surfaces from shading
  // themselves.
  vec3 dx = dFdx(coord);
  vec3 dy = dFdy(coord);
  if (any(lessThan(coord, vec3(0.0))) || any(greaterThan(coord, vec3(1.0)))) return 1.0;
  float area = dx.x * dy.y - dx.y * dy.x;
  vec2 slope = vec2(dy.y * dx.z - dx.y * dy.z, dx.x * dy.z - dy.x * dx.z) / (abs(area) > 1e-12 ? area : 1.0);
  slope *= min(1.0, kSteepest / max(length(slope), 1e-6));
  coord.z -= 0.0005;
  // Interleaved gradient noise turns the disk per pixel, so that bands of few samples become noise.
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  if (kFullShadows == 0) return litPart(coord, slope, turn, kCheapRadius, kCheapSamples);
  float blockers = 0.0;
  float blockerDepth = 0.0;
  for (int i = 0; i < kSearchSamples; ++i) {
    vec2 at = kUvPerDepth * kSearchDepth * diskSample(i, kSearchSamples, turn);
    float depth = textureLod(shadowDepths, coord.xy + at, 0.0).r;
    if (depth < coord.z + dot(slope, at) - kCurvature * length(at)) {
      blockers += 1.0;
      blockerDepth += depth;
    }
  }
  if (blockers == 0.0) return 1.0;
  float radius = max(kUvPerDepth * (coord.z - blockerDepth / blockers), 1.5 / kTexels);
  float lit = litPart(coord, slope, turn, radius, kFilterSamples);
  // Few blockers: the shadow fades out, so that pixels whose search finds none do not stand out.
  return mix(1.0, lit, min(1.0, blockers / 3.0));
}

// Irradiance of the surroundings (Ramamoorthi and Hanrahan 2001).
vec3 irradianceAt(vec3 n) {
  return max(vec3(0.0), frame.irradiance[0].rgb * 0.886227 + frame.irradiance[1].rgb * (1.023328 * n.y) +
                            frame.irradiance[2].rgb * (1.023328 * n.z) +
                            frame.irradiance[3].rgb * (1.023328 * n.x) +
                            frame.irradiance[4].rgb * (0.858086 * n.x * n.y) +
                            frame.irradiance[5].rgb * (0.858086 * n.y * n.z) +
                            frame.irradiance[6].rgb * (0.743125 * n.z * n.z - 0.247708) +
                            frame.irradiance[7].rgb * (0.858086 * n.x * n.z) +
                            frame.irradiance[8].rgb * (0.429043 * (n.x * n.x - n.y * n.y)));
}

float lobe(vec3 direction, vec3 middle, float halfAngle, float blur) {
  float angle = acos(clamp(dot(direction, middle), -1.0, 1.0));
  float widened = halfAngle + 0.5 * blur;
  float strength = (1.0 - cos(halfAngle)) / (1.0 - cos(widened));
  return strength * (1.0 - smoothstep(0.75 * halfAngle - 0.5 * blur, 1.25 * halfAngle + 1.2 * blur, angle));
}

// Radiance of the surroundings, averaged over the reflections of a rough surface.
vec3 radianceAt(vec3 direction, float roughness) {
  float blur = roughness * roughness * 1.2;
  float up = direction.y / (1.0 + 2.0 * blur);
  vec3 sky = mix(frame.skyLevel.rgb, up > 0.0 ? frame.skyAbove.rgb : frame.skyBelow.rgb,
                 min(1.0, abs(up) * (up > 0.0 ? 1.3 : 3.0)));
  return sky + frame.skyKey.rgb * lobe(direction, frame.keyDirection.xyz, 0.42, blur) +
         frame.skyRim.rgb * lobe(direction, frame.rimDirection.xyz, 0.5, blur);
}

struct Material {
  vec3 colour;
  float roughness;
  vec3 specular;  // reflectance at normal incidence
  vec3 sheen;
  float sheenRoughness;
  float translucency;
  float reflection;
};

// GGX with the visibility of Smith (Karis 2013).
vec3 specularOf(Material m, float nl, float nv, float nh, float lh) {
  float a = m.roughness * m.roughness;
  float d = nh * nh * (a * a - 1.0) + 1.0;
  float distribution = a * a / (kPi * d * d);
  float visibility =
      0.5 /
      max(nl * sqrt(nv * nv * (1.0 - a * a) + a * a) + nv * sqrt(nl * nl * (1.0 - a * a) + a * a), 1e-4);
  vec3 fresnel = m.specular + (vec3(1.0) - m.specular) * pow(1.0 - lh, 5.0);
  return fresnel * distribution * visibility;
}

// Sheen of fibres (Estevez and Kulla 2017, visibility of Neubelt and Pettineo 2013).
vec3 sheenOf(Material m, float nl, float nv, float nh) {
  float a = max(m.sheenRoughness * m.sheenRoughness, 0.01);
  float sine = sqrt(max(1.0 - nh * nh, 0.0078125));
  float distribution = (2.0 + 1.0 / a) * pow(sine, 1.0 / a) / (2.0 * kPi);
  return m.sheen * distribution / (4.0 * (nl + nv - nl * nv) + 1e-4);
}

vec3 lightFrom(Material m, vec3 n, vec3 v, vec3 l, vec3 irradiance) {
  float nl = dot(n, l);
  float nv = max(dot(n, v), 0.02);
  vec3 light = vec3(0.0);
  if (nl > 0.0) {
    vec3 h = normalize(l + v);
    float nh = clamp(dot(n, h), 0.0, 1.0);
    light = m.colour / kPi + specularOf(m, nl, nv, nh, clamp(dot(l, h), 0.0, 1.0));
    if (m.sheen != vec3(0.0)) light += sheenOf(m, nl, nv, nh);
    light *= nl;
  }
  return irradiance * (light + m.translucency * max(-nl, 0.0) * m.colour / kPi);
}

// Light that leaves a surface towards the viewer. `n` is the shading normal and `geometric` that of the
// geometry, both on the side of the viewer.
vec3 shade(Material m, vec3 place, vec3 n, vec3 geometric, vec3 eye) {
  vec3 v = normalize(eye - place);
  vec3 light = lightFrom(m, n, v, frame.keyDirection.xyz, keyLit(place, geometric) * frame.keyLight.rgb);
  light += lightFrom(m, n, v, frame.rimDirection.xyz, frame.rimLight.rgb);
  light += m.colour / kPi * mix(irradianceAt(n), irradianceAt(-n), 0.5 * m.translucency);
  float nv = max(dot(n, v), 0.02);
  // Environment BRDF (Karis 2014).
  vec4 r = m.roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a004 = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
  vec2 ab = vec2(-1.04, 1.04) * a004 + r.zw;
  light += m.reflection * radianceAt(reflect(-v, n), m.roughness) * (m.specular * ab.x + ab.y);
  if (m.sheen != vec3(0.0))
    light += m.sheen * irradianceAt(n) / kPi * pow(1.0 - nv, 3.0) * (0.4 + 0.6 * m.sheenRoughness);
  return light;
}
