// SPDX-License-Identifier: MIT
// Predicts and places a vertex of a phase, and writes its residuals with their expected scales.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_PLACE_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_PLACE_GLSL

#include "shaders/encode/hierarchical/choose.glsl"
#include "shaders/encode/hierarchical/predict.glsl"

// By scale class and component along u, v and n: weights of the parents, the ring and the last frame, of the
// vertex's residuals along n and u, and a constant (proto/codec/hierarchical/residual_model.h).
const uint kScaleClasses = 8;
struct ScaleWeights {
  int parents;
  int ring;
  int last;
  int normal;
  int u;
  int constant;
};
layout(std430, binding = 7) readonly buffer Model {
  ScaleWeights scaleWeights[3 * kScaleClasses];
  uvec4 phases[];  // first slot, end, weight class
};
// kResidualRows words per slot, and three more words if they say so.
layout(std430, binding = 8) writeonly buffer Residuals {
  uint residuals[];
};
layout(std430, binding = 9) writeonly buffer WideResiduals {
  int wideResiduals[];
};

uint byteOf(uint bytes, uint component) {
  return bitfieldExtract(bytes, int(8 * component), 8);
}

// Returns two scales per octave: the octave of the expected magnitude, from the second bit up, and which half
// of it.
uint scaleOf(ScaleWeights w, Prediction p, uint lastMagnitudes, uint component, ivec3 magnitudes) {
  int expected = w.parents * int(byteOf(p.parentMagnitudes, component)) +
                 w.ring * int(byteOf(p.ringMagnitudes, component)) +
                 w.last * int(byteOf(lastMagnitudes, component)) + w.constant;
  expected += component == 2 ? 0 : w.normal * magnitudes.z;
  expected += component == 1 ? w.u * magnitudes.x : 0;
  uint e = uint(clamp(expected, 4, 16383));
  uint octave = uint(findMSB(e));
  return 2 * (octave - 2) + ((e >> (octave - 1)) & 1u);
}

// Starts to rest if the vertex has not moved for some frames and its last position still serves. Vertices
// start in turn, a limited number per frame.
bool startsToRest(uint slot, PastVertex before) {
  ivec4 target = wanted[slot];
  if (isKey() || target.w < kMaxStillFrames || rests(before.node) ||
      !isPromised(target.xyz - ivec3(before.node.xyz))) {
    return false;
  }
  uint turns = (status.restWishes + kRestsInTurn - 1) / kRestsInTurn;
  return (slot + push.sinceKey) % turns == 0;
}

bool goesOnResting(uint slot, PastVertex before) {
  return rests(before.node) && isPromised(wanted[slot].xyz - ivec3(before.node.xyz));
}

void writeRecord(uint slot, Prediction p, PastVertex before, ivec3 position) {
  ivec3 detail = saturate16((position - p.average) >> fineBits());
  ivec3 local = saturate16(project(p.frame, detail) >> kUnitBits);
  uvec3 change = isKey() ? uvec3(0)
                         : pack(saturate16(detail - firstOf(before.detail.xyz)),
                                saturate16(p.ring - secondOf(before.detail.xyz)));
  ivec3 localBefore = isKey() ? local : firstOf(before.local);
  uint fasterXy = (uint(p.faster.x) & 0xFFFFu) | (uint(p.faster.y) << 16);
  made[rowAt(kRowAverage, slot)] = uvec4(uvec3(p.average), fasterXy);
  made[rowAt(kRowDetail, slot)] = uvec4(pack(detail, p.ring), uint(p.faster.z) & 0xFFFFu);
  made[rowAt(kRowChange, slot)] = uvec4(change, 0);
  made[rowAt(kRowChangeBefore, slot)] = uvec4(before.change, 0);
  made[rowAt(kRowTwist, slot)] = uvec4(pack(p.twist, p.moved), 0);
  made[rowAt(kRowLocal, slot)] = uvec4(pack(local, localBefore), 0);
}

void place(uint slot, uint weightClass) {
  PastVertex before = pastOf(slot);
  Prediction p = predict(slot, weightClass, before);
  ivec3 last = ivec3(before.node.xyz);
  ivec3 residual;
  ivec3 position = choose(p.frame, p.position, wanted[slot].xyz, residual);
  bool stays = startsToRest(slot, before);
  if (stays || goesOnResting(slot, before)) {
    residual = ivec3(0);
    position = last;
  }
  ivec3 magnitudes = min(abs(residual), ivec3(kMaxMagnitude));
  uint resting = !isKey() && position == last ? 1u << 24 : 0u;
  made[slot] = uvec4(uvec3(position), uint(magnitudes.x | magnitudes.y << 8 | magnitudes.z << 16) | resting);
  writeRecord(slot, p, before, position);

  uint scaleClass = 3 * (weightClass / 2 + (isKey() ? kScaleClasses / 2 : 0));
  uint scales = 0;
  for (uint c = 0; c < 3; ++c) {
    scales |= scaleOf(scaleWeights[scaleClass + c], p, before.curvature.w, c, magnitudes) << (16 + 5 * c);
  }
  uvec3 r = uvec3(residual) & 0xFFFFu;
  bool isWide = isBeyond16Bits(residual);
  if (isWide) {
    for (uint c = 0; c < 3; ++c) {
      wideResiduals[3 * slot + c] = residual[c];
    }
    r = uvec3(1);
  }
  residuals[slot] = r.x | r.y << 16;
  residuals[push.vertexCount + slot] = r.z | scales | (stays || isWide ? kSpecialWord : 0u);
}

#endif
