// SPDX-License-Identifier: MIT
// Converts vectors and poses.
#include "server/messages/vectors.h"

#include <cmath>

#include <fmt/format.h>

namespace clothstream::messages {

model::Vec3 toVec3(Checks& checks, const Path& path, const v1::Vec3& message, Range allowed) {
  return {checks.number(path / "x", message.x(), allowed), checks.number(path / "y", message.y(), allowed),
          checks.number(path / "z", message.z(), allowed)};
}

model::Quaternion toQuaternion(Checks& checks, const Path& path, const v1::Quaternion& message) {
  const Eigen::Quaterniond q(message.w(), message.x(), message.y(), message.z());
  const double length = q.norm();
  if (length == 0) return model::Quaternion::Identity();
  if (!(std::abs(length - 1) <= limits::kUnitTolerance)) {
    checks.fail(path, fmt::format("({}, {}, {}, {})", message.x(), message.y(), message.z(), message.w()),
                fmt::format("must be a unit quaternion (x, y, z, w), of length 1 within {:g}, or absent",
                            limits::kUnitTolerance));
    return model::Quaternion::Identity();
  }
  return q.normalized().cast<float>();
}

model::Pose toPose(Checks& checks, const Path& path, const v1::Pose& message) {
  return {toVec3(checks, path / "position", message.position(), limits::kPosition),
          toQuaternion(checks, path / "orientation", message.orientation())};
}

void write(const model::Vec3& value, v1::Vec3& message) {
  message.set_x(value.x());
  message.set_y(value.y());
  message.set_z(value.z());
}

void write(const model::Quaternion& value, v1::Quaternion& message) {
  message.set_x(value.x());
  message.set_y(value.y());
  message.set_z(value.z());
  message.set_w(value.w());
}

void write(const model::Pose& value, v1::Pose& message) {
  write(value.position, *message.mutable_position());
  write(value.orientation, *message.mutable_orientation());
}

}  // namespace clothstream::messages
