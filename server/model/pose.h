// SPDX-License-Identifier: MIT
// Places and directions.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace clothstream::model {

// Right-handed, +Y up, -Z forward; metres.
using Vec3 = Eigen::Vector3f;
using Quaternion = Eigen::Quaternionf;

struct Pose {
  Vec3 position = Vec3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

}  // namespace clothstream::model
