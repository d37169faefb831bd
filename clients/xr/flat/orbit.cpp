// SPDX-License-Identifier: MIT
#include "clients/xr/flat/orbit.h"

#include <algorithm>
#include <cmath>

namespace clothstream::xr {
namespace {

constexpr float kFirstYaw = 0.35F, kFirstPitch = 0.16F;
constexpr float kTurn = 3.2F;  // radians for a way as long as the picture is high
constexpr float kZoom = 0.88F;

}  // namespace

void Orbit::lookAt(const Eigen::Vector3f& centre, float radius, float aspect) {
  centre_ = centre;
  const float narrow = std::min(kHalfAngle, std::atan(std::tan(kHalfAngle) * aspect));
  distance_ = 0.95F * radius / std::sin(narrow);
  nearest_ = 0.15F * radius;
  farthest_ = 6 * distance_;
  yaw_ = kFirstYaw;
  pitch_ = kFirstPitch;
}

void Orbit::turn(const Eigen::Vector2f& moved) {
  yaw_ -= kTurn * moved.x();
  pitch_ = std::clamp(pitch_ - kTurn * moved.y(), -0.1F, 1.5F);
}

void Orbit::pan(const Eigen::Vector2f& moved) {
  const float metres = 2 * distance_ * std::tan(kHalfAngle);
  centre_ -= pose().orientation * Eigen::Vector3f(metres * moved.x(), metres * moved.y(), 0);
}

void Orbit::zoom(float steps) {
  distance_ = std::clamp(distance_ * std::pow(kZoom, steps), nearest_, farthest_);
}

Pose Orbit::pose() const {
  const Eigen::Quaternionf orientation = Eigen::AngleAxisf(yaw_, Eigen::Vector3f::UnitY()) *
                                         Eigen::AngleAxisf(-pitch_, Eigen::Vector3f::UnitX());
  return {centre_ + orientation * Eigen::Vector3f(0, 0, distance_), orientation};
}

Eigen::Vector3f Orbit::directionOf(const Eigen::Vector2f& place, float aspect) {
  const float half = std::tan(kHalfAngle);
  return Eigen::Vector3f(place.x() * half * aspect, place.y() * half, -1).normalized();
}

}  // namespace clothstream::xr
