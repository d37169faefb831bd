// SPDX-License-Identifier: MIT
// Bits that the residuals of a sample of vertices have, for each prediction.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/encode/prediction.glsl"

const uint kCostStride = 4;

shared uint costs[2 * kPredictionCount];

uint bitWidth(int value) {
  return uint(findMSB(zigzag(value)) + 1);
}

void measureVertex(uint channel, uint vertex, inout uint sums[kPredictionCount]) {
  Neighbourhood d = gather(channel, vertex, false);
  sums[kAverage] += bitWidth(averageResidual(channel, d));
  sums[kPlanar] += bitWidth(planarResidual(channel, d));
  if (push.predicted != 0) {
    Neighbourhood t = gather(channel, vertex, true);
    sums[kTemporal] += bitWidth(t.here);
    sums[kTemporalAverage] += bitWidth(averageResidual(channel, t));
    sums[kTemporalPlanar] += bitWidth(planarResidual(channel, t));
  }
}

// Reads only the lattice; integer sums, whose order does not matter.
void main() {
  uint self = gl_LocalInvocationIndex;
  if (self < 2 * kPredictionCount) {
    costs[self] = 0;
  }
  barrier();
  uint positionSums[kPredictionCount] = uint[](0, 0, 0, 0, 0);
  uint normalSums[kPredictionCount] = uint[](0, 0, 0, 0, 0);
  uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x * kCostStride;
  for (uint vertex = gl_GlobalInvocationID.x * kCostStride; vertex < push.vertexCount; vertex += stride) {
    for (uint channel = 0; channel < kPositionChannels; ++channel) {
      measureVertex(channel, vertex, positionSums);
    }
    if (kHasNormals != 0) {
      measureVertex(kPositionChannels, vertex, normalSums);
      measureVertex(kPositionChannels + 1, vertex, normalSums);
    }
  }
  for (uint p = 0; p < kPredictionCount; ++p) {
    atomicAdd(costs[p], positionSums[p]);
    atomicAdd(costs[kPredictionCount + p], normalSums[p]);
  }
  barrier();
  if (self < kPredictionCount) {
    atomicAdd(status.positionCosts[self], costs[self]);
    atomicAdd(status.normalCosts[self], costs[kPredictionCount + self]);
  }
}
