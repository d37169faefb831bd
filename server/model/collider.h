// SPDX-License-Identifier: MIT
// Colliders: shapes and their motion over simulated time.
#pragma once

#include <string>
#include <vector>

#include "server/model/pose.h"
#include "server/model/shape.h"

namespace clothstream::model {

struct MotionKey {
  float time = 0;  // s
  Vec3 position = Vec3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

// Repeats from the first key after the last one. Times ascend from 0. Without keys the collider stays at its
// pose.
struct Motion {
  std::vector<MotionKey> keys = {};
  bool steady = false;  // constant speed between keys; otherwise slow at each key (smoothstep)
};

struct Collider {
  std::string name = {};
  Shape shape = Sphere{};
  Pose pose = {};
  float friction = 1;  // Coulomb; multiplied by the friction of the cloth
  Motion motion = {};
};

// Pose at a simulated time: from the motion, or `pose` if the motion has no keys. Orientations between two
// keys follow the shorter path, as the normalised weighted mean of the quaternions. Only + - * / floor and
// sqrt in double are used, so every machine gives the same value.
Pose poseAt(const Pose& pose, const Motion& motion, double seconds);
inline Pose poseAt(const Collider& collider, double seconds) {
  return poseAt(collider.pose, collider.motion, seconds);
}

}  // namespace clothstream::model
