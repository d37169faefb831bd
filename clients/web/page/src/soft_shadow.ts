// SPDX-License-Identifier: MIT
// Soft shadows of an area light: sharp at contacts, softer with distance. Replaces three.js's percentage-closer filter
// by percentage-closer soft shadows (Fernando 2005).

import * as THREE from "three";

const kTexels = 2048;
// Width and depth range of the shadow camera, in radii of the lit sphere. The camera is 4 radii from its centre.
const kWidth = 3.2;
const kNear = 1;
const kFar = 9;
// Diameter of the light divided by its distance.
const kLightSpread = 0.14;
// Largest distance of a searched blocker from the surface, as a fraction of the camera's depth range.
const kSearchDepth = 0.25;
// Samples that search for blockers, and samples that average the shadow.
const kSearchSamples = 12;
const kFilterSamples = 18;
// Samples of a cheap shadow, which is equally soft everywhere, and the radius of their disk in texels.
const kCheapSamples = 5;
const kCheapRadius = 3.5;

const kDepthPerWidth = kWidth / (kFar - kNear);
// Slope of a surface up to which disks are round, and tolerance for its curvature within the reach of a sample.
const kSteepest = 6 * kDepthPerWidth;
const kCurvature = 0.9 * kDepthPerWidth;
// Offset of a surface towards the light, in depth. One along the normal would turn around where light grazes the surface.
const kBias = 0.0005 + (3 * kDepthPerWidth) / kTexels;
const kUvPerDepth = kLightSpread / 2 / kDepthPerWidth;

const kShadowFunction = /* glsl */ `
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

MapPlace mapPlaceOf(vec3 coord) {
  vec3 dx = dFdx(coord);
  vec3 dy = dFdy(coord);
  float area = dx.x * dy.y - dx.y * dy.x;
  vec2 slope = vec2(dy.y * dx.z - dx.y * dy.z, dx.x * dy.z - dy.x * dx.z) / (abs(area) > 1e-18 ? area : 1e-18);
  slope *= min(1.0, 100.0 / max(length(slope), 1e-6));
  float steepness = max(length(slope), 1e-6);
  vec2 along = slope / steepness;
  float narrow = max(0.0, 1.0 - ${kSteepest.toFixed(6)} / steepness);
  return MapPlace(coord, slope, mat2(1.0) - narrow * mat2(along.x * along, along.y * along));
}

// Coordinates and depth of the plane at a place on a disk, with the tolerance for curvature.
vec3 planeAt(MapPlace at, vec2 onDisk) {
  vec2 offset = at.squeeze * onDisk;
  return vec3(at.coord.xy + offset, at.coord.z + dot(at.slope, offset) - ${kCurvature.toFixed(6)} * length(onDisk));
}

// Part of a disk of the map that does not shade the surface.
float litPart(sampler2D shadowMap, MapPlace at, float turn, float radius, int samples) {
  float lit = 0.0;
  for (int i = 0; i < samples; ++i) {
    vec3 plane = planeAt(at, radius * diskSample(i, samples, turn));
    lit += step(plane.z, texture2D(shadowMap, plane.xy).r);
  }
  return lit / float(samples);
}

float softShadow(sampler2D shadowMap, vec3 coord, bool cheap) {
  MapPlace at = mapPlaceOf(coord);
  // Interleaved gradient noise rotates the disk per pixel. It turns bands of few samples into noise.
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  if (cheap) return litPart(shadowMap, at, turn, ${(kCheapRadius / kTexels).toFixed(6)}, ${kCheapSamples});
  float blockers = 0.0;
  float blockerDepth = 0.0;
  for (int i = 0; i < ${kSearchSamples}; ++i) {
    vec2 onDisk = diskSample(i, ${kSearchSamples}, turn);
    // Most samples are near the middle: what is near the surface shades it from there only.
    vec3 plane = planeAt(at, ${(kUvPerDepth * kSearchDepth).toFixed(6)} * length(onDisk) * onDisk);
    float depth = texture2D(shadowMap, plane.xy).r;
    if (depth < plane.z) {
      blockers += 1.0;
      blockerDepth += depth;
    }
  }
  if (blockers == 0.0) return 1.0;
  float radius = max(${kUvPerDepth.toFixed(6)} * (coord.z - blockerDepth / blockers), ${(1.5 / kTexels).toFixed(6)});
  return litPart(shadowMap, at, turn, radius, ${kFilterSamples});
}
`;

const kUnsupported = "This version of three.js is not supported; use the version in package.json";

// Replaces the comparison of three.js's BasicShadowMap, whose maps have plain depths. Call before any material is
// compiled, and set the renderer's shadowMap.type to BasicShadowMap.
export function useSoftShadows(): void {
  const compared = "shadow = step( shadowCoord.z, depth );";
  const lookUp = "float getShadow( sampler2D shadowMap";
  const chunk = THREE.ShaderChunk.shadowmap_pars_fragment;
  const at = chunk.lastIndexOf(lookUp);
  if (at < 0 || chunk.split(compared).length !== 2) throw new Error(kUnsupported);
  THREE.ShaderChunk.shadowmap_pars_fragment = (chunk.slice(0, at) + kShadowFunction + chunk.slice(at)).replace(
    compared,
    "shadow = softShadow( shadowMap, shadowCoord.xyz, shadowRadius == 0.0 );",
  );
}

// Cheap shadows need a sixth of the samples: for headsets and phones. Takes effect in the next frame.
export function setCheapShadows(light: THREE.DirectionalLight, cheap: boolean): void {
  light.shadow.radius = cheap ? 0 : 1;
}

// Aims `light` at a sphere from `direction`.
export function aimSoftLight(light: THREE.DirectionalLight, sphere: THREE.Sphere, direction: THREE.Vector3): void {
  light.castShadow = true;
  light.target.position.copy(sphere.center);
  light.position.copy(direction).setLength(4 * sphere.radius).add(sphere.center);
}

// Sizes the shadow map for a lit sphere of this radius, in metres of the room. It leaves room for cloth that swings out of
// the sphere.
export function sizeSoftShadow(light: THREE.DirectionalLight, radius: number): void {
  const camera = light.shadow.camera;
  camera.left = camera.bottom = (-kWidth / 2) * radius;
  camera.right = camera.top = (kWidth / 2) * radius;
  camera.near = kNear * radius;
  camera.far = kFar * radius;
  camera.updateProjectionMatrix();
  light.shadow.mapSize.setScalar(kTexels);
  light.shadow.bias = -kBias;
}
