// SPDX-License-Identifier: MIT
// Light on a surface: key light with a soft shadow, rim light, and the surroundings without images.
#include "clients/xr/shaders/frame.glsl"

const float kPi = 3.14159265;

layout(set = 0, binding = kShadowDepthsBinding) uniform sampler2D shadowDepths;
layout(set = 0, binding = kShadowBinding) uniform sampler2DShadow shadowMap;

// 1: shadows are softer with the distance from what casts them.
layout(constant_id = 0) const uint kFullShadows = 1;
// 1: the fragments of a quad share what they find in the shadow map. Quads of fragments that are larger than
// pixels are elsewhere.
layout(constant_id = 1) const uint kSharesQuads = 1;

// Percentage-closer soft shadows (Fernando 2005), with the numbers of the page
// (clients/web/page/src/soft_shadow.ts).
const float kTexels = 2048.0;
const float kDepthPerWidth = 3.2 / 8.0;
const float kSteepest = 6.0 * kDepthPerWidth;  // slope up to which disks are round
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

// A place in the shadow map, and the plane of the surface there.
struct MapPlace {
  vec3 coord;
  vec2 slope;    // of depth along the plane
  mat2 squeeze;  // makes disks narrow along the slope of steep planes, which would else shade themselves
};

// Coordinates and depth of the plane at a place on a disk, with the tolerance for curvature.
vec3 planeAt(MapPlace at, vec2 onDisk) {
  vec2 offset = at.squeeze * onDisk;
  return vec3(at.coord.xy + offset, at.coord.z + dot(at.slope, offset) - kCurvature * length(onDisk));
}

// Part of a disk of the map that does not shade the surface.
float litPart(MapPlace at, float turn, float radius, int samples) {
  float lit = 0.0;
  for (int i = 0; i < samples; ++i)
    lit += textureLod(shadowMap, planeAt(at, radius * diskSample(i, samples, turn)), 0.0);
  return lit / float(samples);
}

// Place in the map of a point that is moved off its surface, towards the light. `normal` is that of the
// geometry; a smooth one also moves triangles of a curved surface off those around them. The plane is that of
// the triangle: derivatives of the moved point would follow the normal, which turns around where light grazes
// the surface.
MapPlace mapPlaceOf(vec3 place, vec3 normal) {
  vec3 px = dFdx(place);
  vec3 py = dFdy(place);
  vec3 offset = faceforward(normal, -frame.keyDirection.xyz, normal) * frame.keyLight.w;
  MapPlace at;
  at.coord = (frame.shadow * vec4(place + offset, 1.0)).xyz - vec3(0.0, 0.0, 0.0005);
  vec3 dx = mat3(frame.shadow) * px;
  vec3 dy = mat3(frame.shadow) * py;
  float area = dx.x * dy.y - dx.y * dy.x;
  if (abs(area) < 1e-18) area = 1e-18;
  at.slope = vec2(dy.y * dx.z - dx.y * dy.z, dx.x * dy.z - dy.x * dx.z) / area;
  float steepness = length(at.slope);
  vec2 along = at.slope / max(steepness, 1e-6);
  at.squeeze = mat2(1.0) - max(0.0, 1.0 - kSteepest / max(steepness, 1e-6)) * outerProduct(along, along);
  return at;
}

// Average over the four fragments of a quad. Its call is in uniform control flow.
float quadAverage(float value) {
  if (kSharesQuads == 0) return value;
  vec2 towards = 1.0 - 2.0 * mod(floor(gl_FragCoord.xy), 2.0);
  value += 0.5 * towards.x * dFdxFine(value);
  return value + 0.5 * towards.y * dFdyFine(value);
}

// Turn of the disks of a fragment. Interleaved gradient noise turns them per quad, so that bands of few
// samples become noise; the fragments of a quad complete each other.
float diskTurn() {
  vec2 quad = floor(0.5 * gl_FragCoord.xy);
  vec2 inQuad = mod(floor(gl_FragCoord.xy), 2.0);
  return 6.2831853 * fract(52.9829189 * fract(dot(quad, vec2(0.06711056, 0.00583715)))) +
         1.5707963 * (inQuad.x + 2.0 * inQuad.y);
}

// Light of the key light that arrives, 0 to 1. `normal` is that of the geometry.
float keyLit(vec3 place, vec3 normal) {
  MapPlace at = mapPlaceOf(place, normal);
  bool isInside = all(greaterThan(at.coord, vec3(0.0))) && all(lessThan(at.coord, vec3(1.0)));
  float turn = diskTurn();
  if (kFullShadows == 0) return isInside ? litPart(at, turn, kCheapRadius, kCheapSamples) : 1.0;
  float blockers = 0.0;
  float blockerDepth = 0.0;
  for (int i = 0; i < kSearchSamples; ++i) {
    vec2 onDisk = diskSample(i, kSearchSamples, turn);
    // Most samples are near the middle: what is near the surface shades it from there only.
    vec3 plane = planeAt(at, kUvPerDepth * kSearchDepth * length(onDisk) * onDisk);
    float depth = textureLod(shadowDepths, plane.xy, 0.0).r;
    if (isInside && depth < plane.z) {
      blockers += 1.0;
      blockerDepth += at.coord.z - depth;
    }
  }
  blockers = quadAverage(blockers);
  blockerDepth = quadAverage(blockerDepth);
  float lit = 1.0;
  if (blockers > 0.1) {  // a quarter at least, or rounding
    float radius = max(kUvPerDepth * blockerDepth / blockers, 1.5 / kTexels);
    lit = litPart(at, turn, radius, kFilterSamples);
  }
  // Few blockers: the shadow fades out, so that quads whose search finds none do not stand out.
  return mix(1.0, quadAverage(lit), min(1.0, blockers));
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
