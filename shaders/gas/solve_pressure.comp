// SPDX-License-Identifier: MIT
// Finds the pressure of the gas in a cloth at the end of the substep: model::gasPressure(). One workgroup
// handles the cloth.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/gas/gas.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/fixed_sums.glsl"

layout(binding = 0) uniform samplerBuffer shares;
layout(std430, binding = 1) buffer Gas {
  vec4 gas[];  // by cloth: foreseen volume, square of the substep's length, pressure
};

layout(push_constant) uniform Push {
  GasPush push;
};

// model/gas.h
const float kMostVolumeChange = 0.25;
const float kSmallVolume = 0.1;
const float kTinyResponse = 1e-18;

vec4 shareAt(uint node) {
  return texelFetch(shares, int(CLOTHSTREAM_GAS_SHARE_TEXELS * (push.firstRecord + node) + 1));
}

// Sums of the lane: of the volume and its growth, or of the response.
vec2 sumOfLane(uint lane, bool response) {
  precise vec2 sum = vec2(0.0);
  uint node = lane;
  while (node < push.nodeCount) {
    vec4 share = shareAt(node);
    sum = sum + (response ? vec2(share.z, 0.0) : share.xy);
    node += kLanes;
  }
  return sum;
}

vec2 sumOfNodes(bool response) {
  for (uint lane = self(); lane < kLanes; lane += width()) {
    lanes[lane] = sumOfLane(lane, response);
  }
  return sumOfLanes();
}

float squareRoot(float x) {
  precise float root = x * reciprocalSquareRoot(x);
  return root;
}

void main() {
  vec2 volumeAndGrowth = sumOfNodes(false);
  precise float response = sumOfNodes(true).x;
  if (self() > 0) {
    return;
  }
  vec4 before = gas[push.cloth];
  precise float foreseen = volumeAndGrowth.x + volumeAndGrowth.y;
  // The stages after the gas are assumed to change the volume as in the last substep.
  precise float scale =
      before.y == push.squaredSubstep ? 1.0 : push.squaredSubstep * reciprocal(max(before.y, 1e-20));
  precise float later = before.y == 0.0 ? 0.0 : scale * (volumeAndGrowth.x - before.x);
  precise float volume = foreseen + later;

  precise float excess = push.atRest + (1.0 - volume);
  precise float sum = volume + response;
  precise float difference = volume - response;
  precise float square = difference * difference + (4.0 * response) * (1.0 + push.atRest);
  float root = squareRoot(max(square, 1e-20));
  precise float denominator = sum > 0.0 ? sum + root : 2.0 * response;
  precise float numerator = sum > 0.0 ? 2.0 * excess : root - sum;
  precise float pressure = numerator * reciprocal(max(denominator, 1e-18));
  // model::boundedPressure()
  precise float most = kMostVolumeChange * max(abs(volumeAndGrowth.x), kSmallVolume);
  precise float end = volume + response * pressure;
  precise float nearest = min(max(end, volumeAndGrowth.x - most), volumeAndGrowth.x + most);
  precise float bounded = (nearest - volume) * reciprocal(max(response, kTinyResponse));
  pressure = nearest == end || response < kTinyResponse ? pressure : bounded;
  precise float expected = foreseen + response * pressure;
  gas[push.cloth] = vec4(expected, push.squaredSubstep, snapTiny(pressure), 0.0);
}
