// SPDX-License-Identifier: MIT
// Integer prediction from neighbours and the reference frame, as in proto/codec/lattice/prediction.h.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_PREDICTION_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_PREDICTION_GLSL

#include "shaders/encode/frame.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint kHasNormals = 0;

layout(std430, binding = 0) readonly buffer Lattice {
  int lattice[];
};
layout(std430, binding = 1) readonly buffer Reference {
  int reference[];
};
layout(std430, binding = 2) readonly buffer Neighbours {
  uint neighbours[];
};
layout(std430, binding = 3) buffer Status {
  FrameStatus status;
};

layout(push_constant) uniform Push {
  EncodePush push;
};

const uint kPositionChannels = 3;
const uint kPredictionCount = 5;

const uint kAverage = 0;
const uint kPlanar = 1;
const uint kTemporal = 2;
const uint kTemporalAverage = 3;
const uint kTemporalPlanar = 4;

// Octahedral components count modulo 256, lattice coordinates modulo 2^32.
int wrap(uint channel, int value) {
  return channel < kPositionChannels ? value : bitfieldExtract(value, 0, 8);
}

int change(uint channel, uint vertex, bool temporal) {
  uint at = channel * push.vertexCount + vertex;
  return temporal ? wrap(channel, lattice[at] - reference[at]) : lattice[at];
}

// What is predicted of a vertex, and the same of its neighbours; 0 for those it does not have.
struct Neighbourhood {
  int here;
  int w;
  int n;
  int nw;
  bool left;
  bool up;
};

Neighbourhood gather(uint channel, uint vertex, bool temporal) {
  Neighbourhood d;
  uint links = neighbours[vertex];
  uint toUp = distanceUp(links);
  d.left = hasLeft(links);
  d.up = toUp != 0;
  d.here = change(channel, vertex, temporal);
  d.w = d.left ? change(channel, vertex - 1, temporal) : 0;
  d.n = d.up ? change(channel, vertex - toUp, temporal) : 0;
  d.nw = d.left && d.up ? change(channel, vertex - toUp - 1, temporal) : 0;
  return d;
}

int averageResidual(uint channel, Neighbourhood d) {
  int guess = d.left && d.up ? (d.w + d.n) >> 1 : d.w + d.n;
  return wrap(channel, d.here - guess);
}

int planarResidual(uint channel, Neighbourhood d) {
  return wrap(channel, d.here - (d.w + d.n - d.nw));
}

int residual(uint channel, uint vertex, uint prediction) {
  Neighbourhood d = gather(channel, vertex, prediction >= kTemporal);
  if (prediction == kTemporal) {
    return d.here;
  }
  bool average = prediction == kAverage || prediction == kTemporalAverage;
  return average ? averageResidual(channel, d) : planarResidual(channel, d);
}

uint zigzag(int value) {
  return (uint(value) << 1) ^ uint(value >> 31);
}

#endif
