// SPDX-License-Identifier: MIT
// Records of skinned nodes, and the transforms of their joints.
#ifndef CLOTHSTREAM_SHADERS_CLOTH_SKIN_SKINNED_NODE_GLSL
#define CLOTHSTREAM_SHADERS_CLOTH_SKIN_SKINNED_NODE_GLSL

#include "shaders/cloth_skin/cloth_skin.h"
#include "shaders/shared/arithmetic.glsl"

layout(binding = 0) uniform samplerBuffer skinned;     // SkinnedRecord
layout(binding = 1) uniform samplerBuffer transforms;  // rows of the transforms of joints

struct Influences {
  int joints[4];
  vec4 weights;
};

Influences influencesAt(int record, vec4 joints) {
  int first = int(joints.x), second = int(joints.y), base = int(kJointBase);
  return Influences(int[4](first % base, first / base, second % base, second / base),
                    texelFetch(skinned, record + 3));
}

struct Transform {
  vec4 x, y, z;  // rows: rotation and translation
};

Transform transformAt(int joint) {
  int texel = CLOTHSTREAM_CLOTH_JOINT_TEXELS * joint;
  return Transform(texelFetch(transforms, texel), texelFetch(transforms, texel + 1),
                   texelFetch(transforms, texel + 2));
}

vec3 turned(Transform by, vec3 v) {
  return vec3(dotProduct(by.x.xyz, v), dotProduct(by.y.xyz, v), dotProduct(by.z.xyz, v));
}

vec3 turnedBack(Transform by, vec3 v) {
  precise vec3 sum = v.x * by.x.xyz + v.y * by.y.xyz + v.z * by.z.xyz;
  return sum;
}

// The transform of a point by its joints, linear blend skinning: the mean of their matrices. `first` is the
// transform of joint 0.
Transform blended(Influences by, int first) {
  precise vec4 x = vec4(0.0), y = vec4(0.0), z = vec4(0.0);
  for (int k = 0; k < 4; ++k) {
    Transform joint = transformAt(first + by.joints[k]);
    x = x + by.weights[k] * joint.x;
    y = y + by.weights[k] * joint.y;
    z = z + by.weights[k] * joint.z;
  }
  return Transform(x, y, z);
}

vec3 moved(Transform by, vec3 point) {
  precise vec3 place = turned(by, point) + vec3(by.x.w, by.y.w, by.z.w);
  return place;
}

#endif
