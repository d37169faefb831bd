// SPDX-License-Identifier: MIT
// Converts vectors, poses and motions.
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

model::Motion toMotion(Checks& checks, const Path& path, const v1::Motion& message,
                       const model::Quaternion& orientation) {
  model::Motion motion{{}, message.steady()};
  checks.count(path / "keys", static_cast<std::size_t>(message.keys_size()), 2, limits::kMaxMotionKeys);
  for (int i = 0; i < message.keys_size() && !checks.failed(); ++i) {
    const v1::MotionKey& from = message.keys(i);
    const Path key = path.at("keys", i);
    const float time = checks.number(key / "time", from.time(), limits::kMotionTime);
    if (i == 0 && time != 0)
      checks.fail(key / "time", fmt::format("{}", time), "must be 0, where the motion starts");
    if (i > 0 && time <= motion.keys.back().time)
      checks.fail(
          key / "time", fmt::format("{}", time),
          fmt::format("must be greater than the time of the key before, {}", motion.keys.back().time));
    motion.keys.push_back({time, toVec3(checks, key / "position", from.position(), limits::kPosition),
                           from.has_orientation()
                               ? toQuaternion(checks, key / "orientation", from.orientation())
                               : orientation});
  }
  return motion;
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

void write(const model::Motion& motion, v1::Motion& message) {
  message.set_steady(motion.steady);
  for (const model::MotionKey& key : motion.keys) {
    v1::MotionKey& keyMessage = *message.add_keys();
    keyMessage.set_time(key.time);
    write(key.position, *keyMessage.mutable_position());
    write(key.orientation, *keyMessage.mutable_orientation());
  }
}

}  // namespace clothstream::messages
