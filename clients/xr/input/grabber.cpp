// SPDX-License-Identifier: MIT
#include "clients/xr/input/grabber.h"

#include <limits>

namespace clothstream::xr {

bool Grabber::take(const Limb& limb, const Touchable& cloth, std::uint32_t id) {
  release();
  cs_cloth_point found{};
  const bool isNear = cloth.nearestPoint(limb.grip().position, kReach, found);
  if (!isNear && !(limb.hasRay() && limb.points() && cloth.castRay(limb.ray(), kRayLength, found)))
    return false;
  id_ = id;
  byRay_ = !isNear;
  place_ = found;
  back_ = limb.grip().orientation.conjugate();
  offset_ = back_ * (Eigen::Vector3f(found.position) - limb.grip().position);
  return true;
}

cs_grab Grabber::grab(const Limb& limb) const {
  constexpr float kDefault = std::numeric_limits<float>::quiet_NaN();
  cs_grab grab{};
  grab.id = id_;
  grab.radius = grab.reach = grab.max_force = grab.slip_distance = kDefault;
  grab.place = &place_;
  const Eigen::Vector3f position =
      byRay_ && limb.hasRay() ? Eigen::Vector3f(limb.ray().origin + place_.distance * limb.ray().direction)
                              : limb.grip().apply(offset_);
  Eigen::Map<Eigen::Vector3f>(grab.position) = position;
  if (!byRay_)
    Eigen::Map<Eigen::Vector4f>(grab.orientation) = (limb.grip().orientation * back_).normalized().coeffs();
  return grab;
}

}  // namespace clothstream::xr
