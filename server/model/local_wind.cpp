// SPDX-License-Identifier: MIT
#include "server/model/local_wind.h"

#include <algorithm>

namespace clothstream::model {
namespace {

using Vector = Eigen::Vector3d;

double fade(double share) {
  const double left = std::max(1 - share, 0.0);
  return left * left;
}

Vector velocityOf(const Fan& fan, double speed, const Vector& axis, const Vector& from) {
  const double along = axis.dot(from);
  const double radius = fan.radius + fan.spread * std::max(along, 0.0);
  const double part = along / (along > 0 ? fan.range : fan.radius);
  const double outward = (from - along * axis).squaredNorm() / (radius * radius);
  return speed * fade(part * part) * fade(outward) * axis;
}

// 2 q t is twice axis x r divided by the radius.
Vector velocityOf(const Vortex& vortex, double speed, const Vector& axis, const Vector& from) {
  const Vector around = axis.cross(from) / vortex.radius;
  const double share = from.squaredNorm() / (double{vortex.reach} * vortex.reach);
  return 2 * speed / (1 + around.squaredNorm()) * fade(share) * around;
}

}  // namespace

// Written out, because Eigen rotates with the instructions of each machine. A recorded wind has its pose, and
// its axis needs the same bits everywhere.
Vec3 axisOf(const LocalWind& wind) {
  const Quaternion& q = wind.pose.orientation;
  return {2 * (q.x() * q.y() - q.w() * q.z()), 1 - 2 * (q.x() * q.x() + q.z() * q.z()),
          2 * (q.y() * q.z() + q.w() * q.x())};
}

Eigen::Vector3d velocityAt(std::span<const LocalWind> winds, const Vector& point) {
  Vector sum = Vector::Zero();
  for (const LocalWind& wind : winds) {
    const Vector axis = axisOf(wind).cast<double>();
    const Vector from = point - wind.pose.position.cast<double>();
    sum += std::visit([&](const auto& kind) { return velocityOf(kind, wind.speed, axis, from); }, wind.kind);
  }
  return sum;
}

}  // namespace clothstream::model
