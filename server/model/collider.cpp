// SPDX-License-Identifier: MIT
// Interpolation between motion keys.
#include "server/model/collider.h"

#include <cmath>

namespace clothstream::model {
namespace {

Quaternion between(const Quaternion& from, const Quaternion& to, double part) {
  const Eigen::Vector4d a = from.coeffs().cast<double>();
  const Eigen::Vector4d b = to.coeffs().cast<double>();
  double dot = 0;
  for (int i = 0; i < 4; ++i) dot += a[i] * b[i];
  const double sign = dot < 0 ? -1 : 1;
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  double square = 0;
  for (int i = 0; i < 4; ++i) {
    mean[i] = a[i] + (sign * b[i] - a[i]) * part;
    square += mean[i] * mean[i];
  }
  const double length = std::sqrt(square);
  Quaternion result = Quaternion::Identity();
  for (int i = 0; i < 4; ++i) result.coeffs()[i] = static_cast<float>(mean[i] / length);
  return result;
}

}  // namespace

Pose poseAt(const Pose& resting, const Motion& motion, double seconds) {
  const std::vector<MotionKey>& keys = motion.keys;
  if (keys.empty()) return resting;
  const double period = keys.back().time;
  const double time = seconds - period * std::floor(seconds / period);
  std::size_t next = 1;
  while (next + 1 < keys.size() && time >= keys[next].time) ++next;
  const MotionKey& from = keys[next - 1];
  const MotionKey& to = keys[next];
  const double u = (time - from.time) / (double{to.time} - from.time);
  const double part = motion.steady ? u : u * u * (3 - 2 * u);
  Pose pose{Vec3::Zero(), between(from.orientation, to.orientation, part)};
  for (int axis = 0; axis < 3; ++axis) {
    const double start = from.position[axis];
    pose.position[axis] = static_cast<float>(start + (to.position[axis] - start) * part);
  }
  return pose;
}

}  // namespace clothstream::model
