// SPDX-License-Identifier: MIT
// Takes hold of the cloth with one hand or controller, and holds it.
#pragma once

#include <cstdint>

#include <clothstream/core.h>

#include "clients/xr/input/limb.h"

namespace clothstream::xr {

// Finds points of the cloth that is shown. The functions are cs_nearest_point and cs_cast_ray.
class Touchable {
 public:
  virtual ~Touchable() = default;
  virtual bool nearestPoint(const Eigen::Vector3f& point, float maxDistance, cs_cloth_point& out) const = 0;
  virtual bool castRay(const Ray& ray, float maxDistance, cs_cloth_point& out) const = 0;
};

class Grabber {
 public:
  // Largest distance from a hand to the cloth that it takes hold of, m: the default of Grab.reach in
  // session.proto. The fingers themselves keep the cloth 5 to 6 cm away from where they meet.
  static constexpr float kReach = 0.1f;
  // Largest distance of cloth that a ray takes hold of, m.
  static constexpr float kRayLength = 5;

  // Takes hold of the cloth within the reach of the limb, or else under its ray. `id` is new among the grabs
  // of the client. Returns whether there is any.
  bool take(const Limb& limb, const Touchable& cloth, std::uint32_t id);
  void release() { id_ = 0; }

  bool holds() const { return id_ != 0; }
  std::uint32_t id() const { return id_; }
  // The grab for the present pose of the limb. What a limb holds turns with it. The result points at a member
  // of this object. Call only while it holds.
  cs_grab grab(const Limb& limb) const;
  // Place that was seen and is held.
  const cs_cloth_point& place() const { return place_; }

 private:
  std::uint32_t id_ = 0;  // 0: holds nothing
  bool byRay_ = false;
  cs_cloth_point place_{};
  Eigen::Vector3f offset_ = Eigen::Vector3f::Zero();          // from the limb to the held place, in its frame
  Eigen::Quaternionf back_ = Eigen::Quaternionf::Identity();  // inverse orientation of the limb at the start
};

}  // namespace clothstream::xr
