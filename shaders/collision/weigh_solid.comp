// SPDX-License-Identifier: MIT
// Computes the angle-weighted pseudonormals of the vertices that joints moved, at the start and at the end of
// the tick: Baerentzen and Aanaes, 2005. Writes cannot race: each vertex belongs to one invocation, and reads
// go to positions only.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/collision/solid.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer fans;      // of each vertex: first and count; then FanRecord
layout(binding = 1) uniform samplerBuffer vertices;  // the same memory as `solids`
layout(std430, binding = 2) writeonly buffer Solids {
  vec4 solids[];
};

layout(push_constant) uniform Push {
  SkinPush push;
};

vec3 vertexAt(float vertex, uint end) {
  return texelFetch(vertices,
                    int(push.firstVertex + CLOTHSTREAM_MOVING_VERTEX_TEXELS * uint(vertex) + 2u * end))
      .xyz;
}

vec3 unitVector(vec3 v) {
  precise vec3 unit_ = v * reciprocalSquareRoot(max(dotProduct(v, v), 1e-30));
  return unit_;
}

// Arc cosine with an error below 1e-4: Abramowitz and Stegun, "Handbook of Mathematical Functions", 4.4.45.
float arcCosine(float x) {
  float size = min(abs(x), 1.0);
  precise float left = 1.0 - size;
  precise float root = left * reciprocalSquareRoot(max(left, 1e-20));
  precise float angle = root * (1.5707288 + size * (-0.2121144 + size * (0.0742610 - size * 0.0187293)));
  precise float other = 3.14159265 - angle;
  return x < 0.0 ? other : angle;
}

void main() {
  uint vertex = gl_GlobalInvocationID.x;
  if (vertex >= push.vertexCount) {
    return;
  }
  vec4 fan = texelFetch(fans, int(push.firstFan + vertex));
  for (uint end = 0u; end < 2u; ++end) {
    vec3 here = vertexAt(float(vertex), end);
    precise vec3 sum = vec3(0.0);
    for (uint i = 0u; i < uint(fan.y); ++i) {
      vec4 others = texelFetch(fans, int(uint(fan.x) + i));
      precise vec3 next = vertexAt(others.x, end) - here;
      precise vec3 last = vertexAt(others.y, end) - here;
      precise vec3 weighted =
          arcCosine(dotProduct(unitVector(next), unitVector(last))) * unitVector(crossProduct(next, last));
      sum = sum + weighted;
    }
    solids[push.firstVertex + CLOTHSTREAM_MOVING_VERTEX_TEXELS * vertex + 2u * end + 1u] = vec4(sum, 0.0);
  }
}
