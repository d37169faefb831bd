// SPDX-License-Identifier: MIT
// Vectors, rotations and poses.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace clothstream::model {

// Coordinates are right-handed with +Y up and -Z forward. Units are metres.
using Vec3 = Eigen::Vector3f;
using Quaternion = Eigen::Quaternionf;

struct Pose {
  Vec3 position = Vec3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

}  // namespace clothstream::model
