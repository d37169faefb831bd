// SPDX-License-Identifier: MIT
// Quantises positions to integers in coding order, and finds out which vertices stand still.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/encode/hierarchical/slots.glsl"

layout(binding = 0) uniform samplerBuffer positions;
layout(std430, binding = 1) readonly buffer SlotTable {
  uint slotTable[];  // the first row has the vertices
};
layout(std430, binding = 2) readonly buffer Past {
  uvec4 past[];
};
layout(std430, binding = 3) buffer Wanted {
  ivec4 wanted[];
};
layout(std430, binding = 4) buffer Status {
  SlotStatus status;
};

shared uint moved;
shared uint restWishes;

const int kLimit = (1 << 27) - (4 << 8);

// Multiplies by push.scale, exactly (53 bits). Rounds to the nearest integer, and to the even one of two.
int quantise(float x) {
  uint bits = floatBitsToUint(x);
  uint exponent = (bits >> 23) & 0xFFu;
  bool isNegative = (bits >> 31) != 0;
  uint mantissa = bits & 0x7FFFFFu;
  if (exponent == 0) {
    return 0;  // far below half a unit
  }
  if (exponent == 255 && mantissa != 0) {
    return -kLimit;
  }
  uint high, low;
  umulExtended(mantissa | 0x800000u, push.scale, high, low);
  // The number is (high, low) / 2^down, with (high, low) at least 2^51.
  int down = 150 + int(push.scaleShift) - int(exponent);
  uint magnitude;
  if (down < 24) {
    magnitude = uint(kLimit);
  } else if (down > 54) {
    magnitude = 0;
  } else {
    bool hasHigh = down >= 32;
    uint whole = hasHigh ? high >> (down - 32) : (high << (32 - down)) | (low >> down);
    // Fraction bits from the highest one down, and whether there are more.
    uint rest =
        hasHigh ? (down == 32 ? low : (high << (64 - down)) | (low >> (down - 32))) : low << (32 - down);
    bool hasMore = down > 32 && (low << (64 - down)) != 0;
    bool up = rest > 0x80000000u || (rest == 0x80000000u && (hasMore || (whole & 1u) != 0));
    magnitude = min(whole + (up ? 1u : 0u), uint(kLimit));
  }
  return isNegative ? -int(magnitude) : int(magnitude);
}

// Writes cannot race: one invocation per slot. The workgroup adds up in shared memory first.
void main() {
  if (gl_LocalInvocationIndex == 0) {
    moved = 0;
    restWishes = 0;
  }
  barrier();
  uint slot = gl_GlobalInvocationID.x;
  if (slot < push.vertexCount) {
    vec3 p = texelFetch(positions, int(slotTable[slot])).xyz;
    ivec3 q = ivec3(quantise(p.x), quantise(p.y), quantise(p.z));
    ivec4 before = wanted[slot];
    uint still = q == before.xyz ? min(uint(before.w) + 1, kMaxStillFrames) : 0;
    wanted[slot] = ivec4(q, int(still));
    if (!isKey()) {
      uvec4 reference = past[slot];
      bool serves = isPromised(q - ivec3(reference.xyz));
      if (!serves) {
        atomicOr(moved, 1);
      }
      if (serves && still == kMaxStillFrames && !rests(reference)) {
        atomicAdd(restWishes, 1);
      }
    }
  }
  barrier();
  if (gl_LocalInvocationIndex == 0) {
    atomicOr(status.moved, moved);
    atomicAdd(status.restWishes, restWishes);
  }
}
