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
// Largest slope of a surface, and tolerance for its curvature within the reach of a sample.
const kSteepest = 6 * kDepthPerWidth;
const kCurvature = 0.9 * kDepthPerWidth;
const kUvPerDepth = kLightSpread / 2 / kDepthPerWidth;

const kShadowFunction = /* glsl */ `
vec2 diskSample(int index, int count, float turn) {
  float angle = float(index) * 2.399963 + turn;
  return sqrt((float(index) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}

// Part of a disk of the map that does not shade the surface.
float litPart(sampler2D shadowMap, vec3 coord, vec2 slope, float turn, float radius, int samples) {
  float lit = 0.0;
  for (int i = 0; i < samples; ++i) {
    vec2 offset = radius * diskSample(i, samples, turn);
    float depth = texture2D(shadowMap, coord.xy + offset).r;
    lit += step(coord.z + dot(slope, offset) - ${kCurvature.toFixed(6)} * length(offset), depth);
  }
  return lit / float(samples);
}

float softShadow(sampler2D shadowMap, vec3 coord, bool cheap) {
  // Slope of depth along the surface in map coordinates. It prevents inclined surfaces from shading themselves.
  vec3 dx = dFdx(coord);
  vec3 dy = dFdy(coord);
  float area = dx.x * dy.y - dx.y * dy.x;
  vec2 slope = vec2(dy.y * dx.z - dx.y * dy.z, dx.x * dy.z - dy.x * dx.z) / (abs(area) > 1e-12 ? area : 1.0);
  slope *= min(1.0, ${kSteepest.toFixed(6)} / max(length(slope), 1e-6));

  // Interleaved gradient noise rotates the disk per pixel. It turns bands of few samples into noise.
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  if (cheap) return litPart(shadowMap, coord, slope, turn, ${(kCheapRadius / kTexels).toFixed(6)}, ${kCheapSamples});
  float blockers = 0.0;
  float blockerDepth = 0.0;
  for (int i = 0; i < ${kSearchSamples}; ++i) {
    vec2 offset = ${(kUvPerDepth * kSearchDepth).toFixed(6)} * diskSample(i, ${kSearchSamples}, turn);
    float depth = texture2D(shadowMap, coord.xy + offset).r;
    if (depth < coord.z + dot(slope, offset) - ${kCurvature.toFixed(6)} * length(offset)) {
      blockers += 1.0;
      blockerDepth += depth;
    }
  }
  if (blockers == 0.0) return 1.0;
  float radius = max(${kUvPerDepth.toFixed(6)} * (coord.z - blockerDepth / blockers), ${(1.5 / kTexels).toFixed(6)});
  float lit = litPart(shadowMap, coord, slope, turn, radius, ${kFilterSamples});
  // Few blockers: the shadow fades out, so that pixels whose search finds none do not stand out.
  return mix(1.0, lit, min(1.0, blockers / 3.0));
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
  offsetBothSides();
  THREE.ShaderChunk.shadowmap_pars_fragment = (chunk.slice(0, at) + kShadowFunction + chunk.slice(at)).replace(
    compared,
    "shadow = softShadow( shadowMap, shadowCoord.xyz, shadowRadius == 0.0 );",
  );
}

// Moves the point for which a shadow is looked up towards the light on both sides of a surface. three.js moves it along the
// normal, so a cloth whose front faces away from the light would shade its lit back.
function offsetBothSides(): void {
  const offset = "worldPosition + vec4( shadowWorldNormal * directionalLightShadows[ i ].shadowNormalBias, 0 )";
  const chunk = THREE.ShaderChunk.shadowmap_vertex;
  if (!chunk.includes(offset)) throw new Error(kUnsupported);
  const away = "vec3( directionalShadowMatrix[ i ][ 0 ].z, directionalShadowMatrix[ i ][ 1 ].z, directionalShadowMatrix[ i ][ 2 ].z )";
  THREE.ShaderChunk.shadowmap_vertex = chunk.replace(
    "shadowWorldNormal * directionalLightShadows",
    `faceforward( shadowWorldNormal, ${away}, shadowWorldNormal ) * directionalLightShadows`,
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
  light.shadow.bias = -0.0005;
  light.shadow.normalBias = (3 * kWidth * radius) / kTexels;
}
