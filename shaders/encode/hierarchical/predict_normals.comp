// SPDX-License-Identifier: MIT
// Computes the residuals of normals relative to those that follow from the frame's positions, as in
// proto/codec/hierarchical/normal_prediction.cpp.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/encode/hierarchical/slots.glsl"

layout(binding = 0) uniform samplerBuffer normals;
layout(std430, binding = 1) readonly buffer Made {
  uvec4 made[];
};
layout(std430, binding = 2) readonly buffer Faces {
  uvec4 faces[];  // slots of the corners; kNoCorner as the fourth corner of a triangle
};
// By vertex: start of its faces; then the faces.
layout(std430, binding = 3) readonly buffer FacesOf {
  uint facesOf[];
};
layout(std430, binding = 4) writeonly buffer SentNormals {
  uint sentNormals[];  // by vertex, in the form that is hashed
};
layout(std430, binding = 5) writeonly buffer NormalResiduals {
  uint normalResiduals[];  // by vertex: residuals of u and v, one byte each
};

const int kOctahedralLimit = 127;
const float kOne = 32768.0;
const int kNormalBits = 15;

// Numbers of 64 bits are two words, the low one first, in two's complement.
uvec2 add(uvec2 a, uvec2 b) {
  uint carry;
  uint low = uaddCarry(a.x, b.x, carry);
  return uvec2(low, a.y + b.y + carry);
}

uvec2 negated(uvec2 a) {
  return add(~a, uvec2(1, 0));
}

uvec2 product(int a, int b) {
  int high, low;
  imulExtended(a, b, high, low);
  return uvec2(low, high);
}

bool isLess(uvec2 a, uvec2 b) {
  return a.y < b.y || (a.y == b.y && a.x < b.x);
}

uvec2 sizeOf(uvec2 a) {
  return (a.y >> 31) != 0 ? negated(a) : a;
}

int bitWidth(uvec2 a) {
  return a.y != 0 ? findMSB(a.y) + 33 : findMSB(a.x) + 1;
}

// Shifts a number right that then fits 32 bits.
int shiftedRight(uvec2 a, int bits) {
  if (bits <= 0) {
    return int(a.x << -bits);
  }
  return bits < 32 ? int((a.x >> bits) | (a.y << (32 - bits))) : int(a.y) >> (bits - 32);
}

uvec2 crossPart(ivec3 a, ivec3 b, uint i) {
  uint j = (i + 1) % 3, k = (i + 2) % 3;
  return add(product(a[j], b[k]), negated(product(a[k], b[j])));
}

int octahedralPart(int magnitude, int sum, int signedBy) {
  int rounded = (2 * kOctahedralLimit * magnitude + sum) / (2 * sum);
  return signedBy < 0 ? -rounded : rounded;
}

// Octahedral form of a vector whose components are at most 2^15.
ivec2 encodeOctahedral(ivec3 n) {
  ivec3 a = abs(n);
  int sum = a.x + a.y + a.z;
  if (sum == 0) {
    return ivec2(0);
  }
  ivec2 magnitude = n.z < 0 ? ivec2(sum - a.y, sum - a.x) : a.xy;
  return ivec2(octahedralPart(magnitude.x, sum, n.x), octahedralPart(magnitude.y, sum, n.y));
}

// Fixed-point form of a component; -1 for a NaN.
int fixedPoint(float x) {
  precise float q = floor(x * kOne + 0.5);
  float low = q >= -kOne ? q : -kOne;
  return int(low > kOne ? kOne : low);
}

// The axes of the octahedron with this top; the other two follow it.
uvec3 axesOf(uint top) {
  return uvec3((top + 1) % 3, (top + 2) % 3, top);
}

// Writes cannot race: one invocation per vertex.
void main() {
  uint vertex = gl_GlobalInvocationID.x;
  if (vertex >= push.vertexCount) {
    return;
  }
  uvec2 sum[3] = uvec2[](uvec2(0), uvec2(0), uvec2(0));
  for (uint at = facesOf[vertex]; at < facesOf[vertex + 1]; ++at) {
    uvec4 face = faces[facesOf[at]];
    ivec3 p = ivec3(made[face.x].xyz), a = ivec3(made[face.y].xyz), c = ivec3(made[face.z].xyz);
    bool isQuad = face.w != kNoCorner;
    // Diagonals of a quad, or two sides of a triangle.
    ivec3 first = isQuad ? c - p : a - p;
    ivec3 second = isQuad ? ivec3(made[isQuad ? face.w : face.x].xyz) - a : c - p;
    for (uint i = 0; i < 3; ++i) {
      sum[i] = add(sum[i], crossPart(first, second, i));
    }
  }
  uint top = 2;
  for (uint i = 0; i < 2; ++i) {
    top = isLess(sizeOf(sum[top]), sizeOf(sum[i])) ? i : top;
  }
  int down = bitWidth(sizeOf(sum[top])) - kNormalBits;
  uvec3 axes = axesOf(top);
  ivec3 expected = ivec3(shiftedRight(sum[axes.x], down), shiftedRight(sum[axes.y], down),
                         shiftedRight(sum[axes.z], down));
  bool isDown = expected.z < 0;
  expected.z = abs(expected.z);
  vec3 normal = texelFetch(normals, int(vertex)).xyz;
  float up = normal[axes.z];
  precise float down_ = -up;
  ivec3 actual =
      ivec3(fixedPoint(normal[axes.x]), fixedPoint(normal[axes.y]), fixedPoint(isDown ? down_ : up));
  ivec2 sent = encodeOctahedral(actual);
  uvec2 residual = uvec2(sent - encodeOctahedral(expected)) & 0xFFu;
  sentNormals[vertex] = (uint(sent.x) & 0xFFu) | (uint(sent.y) & 0xFFu) << 8;
  normalResiduals[vertex] = residual.x | residual.y << 8;
}
