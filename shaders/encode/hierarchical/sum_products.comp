// SPDX-License-Identifier: MIT
// Adds up products of features over chunks of vertices, which say which weights would have predicted them
// best; ProductSums does the same (proto/codec/hierarchical/weight_fitter.h).
#version 450
#extension GL_GOOGLE_include_directive : require

#define MADE_QUALIFIERS readonly
#include "shaders/encode/hierarchical/predict.glsl"

layout(std430, binding = 7) readonly buffer FittedChunks {
  uvec4 fittedChunks[];  // by workgroup: first slot, end, weight class
};
layout(std430, binding = 8) writeonly buffer Products {
  float products[];  // kFeatureProducts per workgroup
};

// By slot: the features and then the goal, component by component; and the importance of the slot.
const uint kColumns = kClassFeatures + 1;
shared float values[kChunkSlots][3 * kColumns];
shared float importances[kChunkSlots];

void keep(uint i, uint column, ivec3 value, float unit) {
  for (uint c = 0; c < 3; ++c) {
    precise float scaled = float(value[c]) * unit;
    values[i][3 * column + c] = scaled;
  }
}

// Importance of a vertex for the weights. Vertices that are hard to predict must not spoil the weights for
// the rest.
float importanceOf(uint magnitudes, uint parentMagnitudes) {
  uvec3 shifts = uvec3(0, 8, 16);
  uvec3 m = (uvec3(magnitudes) >> shifts) & 0xFFu, around = (uvec3(parentMagnitudes) >> shifts) & 0xFFu;
  uint own = m.x + m.y + m.z;
  uint wrong = 6 + 4 * own * own + around.x + around.y + around.z;
  return uintBitsToFloat(0x7EF311C3u - floatBitsToUint(float(wrong)));
}

ivec3 turned(SurfaceFrame frame, ivec3 along, bool isAcross) {
  const int kDown = kUnitBits - kTurnedBits;
  ivec3 sum = isAcross ? frame.n * along.z : frame.u * along.x + frame.v * along.y;
  return saturate16((sum + (1 << (kDown - 1))) >> kDown);
}

void keepVertex(uint i, uint slot, uint weightClass) {
  PastVertex before = pastOf(slot);
  Prediction p = predict(slot, weightClass, before);
  ivec3 features[kPlainFeatures];
  plainFeatures(p, before, features);
  ivec3 predicted = ivec3(0);
  for (uint f = 0; f < kPlainFeatures; ++f) {
    predicted += weightOf(weightClass, f) * features[f];
    keep(i, f, features[f], 1.0);
  }
  ivec3 now = firstOf(before.local);
  ivec3 change = saturate16(now - secondOf(before.local));
  ivec3 predictedTurned = ivec3(0);
  for (uint f = 0; f < 4; ++f) {
    ivec3 feature = turned(p.frame, f < 2 ? now : change, (f & 1u) != 0);
    predictedTurned += weightOf(weightClass, kPlainFeatures + f) * feature;
    keep(i, kPlainFeatures + f, feature, 1.0 / float(1 << kTurnedBits));
  }
  predicted += predictedTurned >> kTurnedBits;
  ivec3 goal = ((wanted[slot].xyz - p.position) >> fineBits()) + (predicted >> kWeightBits);
  keep(i, kClassFeatures, goal, 1.0);
  importances[i] = importanceOf(made[slot].w, p.parentMagnitudes);
}

// Sum of products of feature i and column j.
float sumOf(uint count, uint i, uint j) {
  precise vec3 sum = vec3(0.0);
  for (uint k = 0; k < count; ++k) {
    vec3 a = vec3(values[k][3 * i], values[k][3 * i + 1], values[k][3 * i + 2]);
    vec3 b = vec3(values[k][3 * j], values[k][3 * j + 1], values[k][3 * j + 2]);
    precise vec3 left = a * importances[k];
    sum += left * b;
  }
  precise float all_ = sum.x + sum.y + sum.z;
  return all_;
}

// Writes cannot race: in shared memory one invocation per slot, then one per product.
void main() {
  uvec4 chunk = fittedChunks[gl_WorkGroupID.x];
  uint count = chunk.y - chunk.x;
  for (uint i = gl_LocalInvocationIndex; i < count; i += gl_WorkGroupSize.x) {
    keepVertex(i, chunk.x + i, chunk.z);
  }
  barrier();
  for (uint at = gl_LocalInvocationIndex; at < kFeatureProducts; at += gl_WorkGroupSize.x) {
    uint i = 0, j = at;
    while (j > kClassFeatures) {
      ++i;
      j -= kColumns - i;
    }
    products[gl_WorkGroupID.x * kFeatureProducts + at] = sumOf(count, i, j);
  }
}
