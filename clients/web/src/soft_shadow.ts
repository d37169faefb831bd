// SPDX-License-Identifier: MIT
// Shadows of a light that is not a point: sharp where things touch, softer the further the shadow falls. Percentage-
// closer soft shadows (Fernando 2005) in the place of three.js's percentage-closer filter.

import * as THREE from "three";

const kTexels = 2048;
// Of the shadow camera, in radii of what it looks at, which it stands 4 radii away from.
const kWidth = 3.2;
const kNear = 1;
const kFar = 9;
// Diameter of the light over its distance.
const kLightSpread = 0.14;
// How far in front of a surface, as a part of the camera's depth, something that shades it is looked for.
const kSearchDepth = 0.25;
// Samples that look for what shades, and that find how much of it does.
const kSearchSamples = 12;
const kFilterSamples = 18;

const kDepthPerWidth = kWidth / (kFar - kNear);
// Largest slope along a surface that is believed, and how much it may bend within a sample's reach.
const kSteepest = 6 * kDepthPerWidth;
const kCurvature = 0.9 * kDepthPerWidth;
const kUvPerDepth = kLightSpread / 2 / kDepthPerWidth;

const kShadowFunction = /* glsl */ `
vec2 diskSample(int index, int count, float turn) {
  float angle = float(index) * 2.399963 + turn;
  return sqrt((float(index) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}

float softShadow(sampler2D shadowMap, vec3 coord) {
  // Depth over the map's axes along the shaded surface, so that it does not shade itself where it leans.
  vec3 dx = dFdx(coord);
  vec3 dy = dFdy(coord);
  float area = dx.x * dy.y - dx.y * dy.x;
  vec2 slope = vec2(dy.y * dx.z - dx.y * dy.z, dx.x * dy.z - dy.x * dx.z) / (abs(area) > 1e-12 ? area : 1.0);
  slope *= min(1.0, ${kSteepest.toFixed(6)} / max(length(slope), 1e-6));

  // Interleaved gradient noise turns the disk from pixel to pixel, so that few samples leave no bands.
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  float blockers = 0.0;
  float blockerDepth = 0.0;
  for (int i = 0; i < ${kSearchSamples}; ++i) {
    vec2 offset = ${(kUvPerDepth * kSearchDepth).toFixed(6)} * diskSample(i, ${kSearchSamples}, turn);
    float depth = unpackRGBAToDepth(texture2D(shadowMap, coord.xy + offset));
    if (depth < coord.z + dot(slope, offset) - ${kCurvature.toFixed(6)} * length(offset)) {
      blockers += 1.0;
      blockerDepth += depth;
    }
  }
  if (blockers == 0.0) return 1.0;
  float radius = max(${kUvPerDepth.toFixed(6)} * (coord.z - blockerDepth / blockers), ${(1.5 / kTexels).toFixed(6)});
  float lit = 0.0;
  for (int i = 0; i < ${kFilterSamples}; ++i) {
    vec2 offset = radius * diskSample(i, ${kFilterSamples}, turn);
    float depth = unpackRGBAToDepth(texture2D(shadowMap, coord.xy + offset));
    lit += step(coord.z + dot(slope, offset) - ${kCurvature.toFixed(6)} * length(offset), depth);
  }
  return lit / ${kFilterSamples}.0;
}
`;

// Replaces three.js's filter for maps of the type PCFShadowMap. To be called before any material is compiled.
export function useSoftShadows(): void {
  const filter = "#if defined( SHADOWMAP_TYPE_PCF )";
  const lookUp = "float getShadow(";
  const chunk = THREE.ShaderChunk.shadowmap_pars_fragment;
  if (!chunk.includes(filter) || !chunk.includes(lookUp)) throw new Error("three.js has other shadow shaders than expected");
  THREE.ShaderChunk.shadowmap_pars_fragment = chunk
    .replace(lookUp, kShadowFunction + lookUp)
    .replace(filter, `${filter}\nshadow = softShadow( shadowMap, shadowCoord.xyz );\n#elif defined( SHADOWMAP_TYPE_PCF_OF_THREE )`);
}

// Lets `light` shine on a ball from the given direction, with room in its shadow for what swings out of the ball.
export function aimSoftLight(light: THREE.DirectionalLight, ball: THREE.Sphere, direction: THREE.Vector3): void {
  light.castShadow = true;
  light.target.position.copy(ball.center);
  light.position.copy(direction).setLength(4 * ball.radius).add(ball.center);
  const camera = light.shadow.camera;
  camera.left = camera.bottom = (-kWidth / 2) * ball.radius;
  camera.right = camera.top = (kWidth / 2) * ball.radius;
  camera.near = kNear * ball.radius;
  camera.far = kFar * ball.radius;
  camera.updateProjectionMatrix();
  light.shadow.mapSize.setScalar(kTexels);
  light.shadow.bias = -0.0005;
  light.shadow.normalBias = (3 * kWidth * ball.radius) / kTexels;
}
