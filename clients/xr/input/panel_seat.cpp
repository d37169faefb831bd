// SPDX-License-Identifier: MIT
#include "clients/xr/input/panel_seat.h"

#include <cmath>

namespace clothstream::xr {
namespace {

// Place of the panel's middle in metres from the feet of the user, who looks along -Z.
constexpr float kAside = -0.6f, kHeight = 1.25f, kAhead = -0.3f;
constexpr float kHalfHeight = 0.25f;
constexpr float kEyes = 1.5f;
// Place of the upper edge before the eyes: nearer than the scene, which must not hide it.
constexpr float kBefore = 0.45f, kAboveEyes = 0.1f;

Eigen::Quaternionf turned(float yaw) {
  return Eigen::Quaternionf(Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitY()));
}

}  // namespace

void PanelSeat::seat(const Pose& head) {
  const Pose feet{{head.position.x(), 0, head.position.z()}, turned(yawOf(head.orientation))};
  const float tilt = -std::atan2(kEyes - kHeight, std::hypot(kAside, kAhead));
  const Eigen::Quaternionf facing =
      turned(std::atan2(-kAside, -kAhead)) * Eigen::AngleAxisf(tilt, Eigen::Vector3f::UnitX());
  seat_ = feet * Pose{{kAside, kHeight, kAhead}, facing} *
          Pose{{0, kHalfHeight, 0}, Eigen::Quaternionf::Identity()};
  pose_ = seat_;
}

void PanelSeat::comeBefore(const Pose& head) {
  const Eigen::Quaternionf yaw = turned(yawOf(head.orientation));
  const Eigen::Vector3f look = yaw * -Eigen::Vector3f::UnitZ();
  pose_ = {head.position + kBefore * look + Eigen::Vector3f(0, kAboveEyes, 0), yaw};
}

}  // namespace clothstream::xr
