// SPDX-License-Identifier: MIT
// The position at which codec 2 expects a vertex, as in proto/codec/hierarchical/predictor.h. FRAME_FORMAT.md
// defines the letters.
//
// The including kernel defines MADE_QUALIFIERS: the memory qualifiers of the moment that is being made.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_PREDICT_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_PREDICT_GLSL

#include "shaders/encode/hierarchical/slots.glsl"
#include "shaders/encode/hierarchical/surface_frame.glsl"

const int kWeightBits = 10;
const int kTurnedBits = 2;
const int kParentBits = 6;

layout(std430, binding = 0) readonly buffer Links {
  uvec4 links[];
};
layout(std430, binding = 1) readonly buffer Past {
  uvec4 past[];
};
layout(std430, binding = 2) MADE_QUALIFIERS buffer Made {
  uvec4 made[];
};
layout(std430, binding = 3) readonly buffer Wanted {
  ivec4 wanted[];  // positions by slot; w: number of frames without change
};
layout(std430, binding = 4) readonly buffer Status {
  SlotStatus status;
};
layout(std430, binding = 5) readonly buffer ClassWeights {
  int weights[kAllWeights];
};

layout(std430, binding = 6) readonly buffer SlotTable {
  uint slotTable[];  // the vertex, then three weights of parents
};

// Weighted mean of the parents, with weights in 2^-kParentBits; the first parent has the rest of a whole.
// With equal weights the products would need more than 32 bits, but the plain sum does not overflow.
ivec3 averageOf(uint slot, ivec3 p0, ivec3 p1, ivec3 p2, ivec3 p3) {
  uint packed_ = slotTable[push.vertexCount + slot];
  if (packed_ == kEqualParentWeights) {
    return (p0 + p1 + p2 + p3 + 2) >> 2;
  }
  ivec3 w = ivec3(bitfieldExtract(int(packed_), 0, 10), bitfieldExtract(int(packed_), 10, 10),
                  bitfieldExtract(int(packed_), 20, 10));
  ivec3 sum = (p1 - p0) * w.x + (p2 - p0) * w.y + (p3 - p0) * w.z;
  return p0 + ((sum + (1 << (kParentBits - 1))) >> kParentBits);
}

int weightOf(uint weightClass, uint feature) {
  if (weightClass >= kClasses || (!isKey() && status.moved == 0)) {
    return 0;
  }
  uint first = push.hasWeights != 0 ? kSentWeights : kKeptWeights;
  return weights[first + kClassFeatures * weightClass + feature];
}

// A vertex's node and record in the reference; zeros in a key frame.
struct PastVertex {
  uvec4 node;
  uvec4 average;
  uvec4 detail;
  uvec3 change;
  uvec3 changeBefore;
  uvec3 twist;
  uvec3 local;
  uvec4 curvature;
};

PastVertex pastOf(uint slot) {
  if (isKey()) {
    return PastVertex(uvec4(0), uvec4(0), uvec4(0), uvec3(0), uvec3(0), uvec3(0), uvec3(0), uvec4(0));
  }
  return PastVertex(past[slot], past[rowAt(kRowAverage, slot)], past[rowAt(kRowDetail, slot)],
                    past[rowAt(kRowChange, slot)].xyz, past[rowAt(kRowChangeBefore, slot)].xyz,
                    past[rowAt(kRowTwist, slot)].xyz, past[rowAt(kRowLocal, slot)].xyz,
                    past[rowAt(kRowCurvature, slot)]);
}

struct Prediction {
  ivec3 position;
  ivec3 average;
  SurfaceFrame frame;
  ivec3 twist;   // Q
  ivec3 ring;    // G
  ivec3 moved;   // T
  ivec3 faster;  // T0 - T1
  // Sums over the parents and over the ring, in the format of a node.
  uint parentMagnitudes;
  uint ringMagnitudes;
};

// Number of features that do not rotate with the surface.
const uint kPlainFeatures = 12;

void plainFeatures(Prediction p, PastVertex before, out ivec3 features[kPlainFeatures]) {
  features[0] = firstOf(before.detail.xyz);
  features[1] = secondOf(before.detail.xyz);
  features[2] = firstOf(before.change);
  features[3] = secondOf(before.change);
  features[4] = firstOf(before.changeBefore);
  features[5] = secondOf(before.changeBefore);
  features[6] = saturate16(p.twist - firstOf(before.twist));
  features[7] = saturate16(p.ring - secondOf(before.detail.xyz));
  features[8] = firstOf(before.curvature.xyz);
  features[9] = secondOf(before.curvature.xyz);
  features[10] = p.faster;
  features[11] =
      ivec3(firstOf(before.average.www).x, secondOf(before.average.www).x, firstOf(before.detail.www).x);
}

// The detail along u, v and n that follows from the last two frames. Weights 12 and 14 belong to u and v,
// weights 13 and 15 to n.
ivec3 wishedDetail(uint weightClass, ivec3 now, ivec3 change) {
  int along = weightOf(weightClass, 12), across = weightOf(weightClass, 13);
  int alongChange = weightOf(weightClass, 14), acrossChange = weightOf(weightClass, 15);
  ivec3 sum = ivec3(along, along, across) * now + ivec3(alongChange, alongChange, acrossChange) * change;
  const int kDown = kWeightBits - kTurnedBits;
  return saturate16((sum + (1 << (kDown - 1))) >> kDown);
}

Prediction predict(uint slot, uint weightClass, PastVertex before) {
  uint n = push.vertexCount;
  uvec4 parents = links[slot];
  uvec4 near = links[kLinkRing * n + slot], far = links[(kLinkRing + 1) * n + slot];
  uvec4 p0 = made[parents.x], p1 = made[parents.y], p2 = made[parents.z], p3 = made[parents.w];
  uvec4 sum = p0 + p1 + p2 + p3;
  uvec4 ring = made[near.x] + made[near.y] + made[near.z] + made[near.w] + made[far.x] + made[far.y] +
               made[far.z] + made[far.w];
  Prediction p;
  p.average = averageOf(slot, ivec3(p0.xyz), ivec3(p1.xyz), ivec3(p2.xyz), ivec3(p3.xyz));
  p.parentMagnitudes = sum.w;
  p.ringMagnitudes = ring.w;
  p.frame = surfaceFrame(ivec3(p1.xyz - p0.xyz), ivec3(p3.xyz - p2.xyz));
  p.ring = saturate16((((ivec3(ring.xyz) + 4) >> 3) - p.average) >> fineBits());
  p.twist = saturate16(ivec3(p0.xyz + p1.xyz - p2.xyz - p3.xyz) >> (2 + fineBits()));
  // Nothing moves in a key frame.
  ivec3 averageBefore = isKey() ? p.average : ivec3(before.average.xyz);
  p.moved = saturate16((p.average - averageBefore) >> fineBits());
  p.faster = saturate16(p.moved - secondOf(before.twist));
  if (rests(before.node)) {
    p.position = ivec3(before.node.xyz);
    return p;
  }
  ivec3 features[kPlainFeatures];
  plainFeatures(p, before, features);
  // Sums are sixteenths of a step times 2^kWeightBits. The shift converts them to units; half a unit is added
  // for rounding.
  int down = kWeightBits - fineBits();
  ivec3 change = ivec3(1 << (down - 1));
  for (uint f = 0; f < kPlainFeatures; ++f) {
    change += weightOf(weightClass, f) * features[f];
  }
  ivec3 now = firstOf(before.local);
  ivec3 wished = wishedDetail(weightClass, now, now - secondOf(before.local));
  change += combine(p.frame, wished) >> (kUnitBits + kTurnedBits - kWeightBits);
  p.position = p.average + (ivec3(before.node.xyz) - ivec3(before.average.xyz)) + (change >> down);
  return p;
}

#endif
