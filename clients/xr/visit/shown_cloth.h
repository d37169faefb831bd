// SPDX-License-Identifier: MIT
// The cloth that a client shows, as what hands touch.
#pragma once

#include "clients/xr/input/grabber.h"
#include "clients/xr/input/placement.h"

namespace clothstream::xr {

// Valid as long as the client is acquired.
class ShownCloth final : public Touchable {
 public:
  explicit ShownCloth(const cs_client* client) : client_(client) {}
  bool nearestPoint(const Eigen::Vector3f& point, float maxDistance, cs_cloth_point& out) const override {
    return cs_nearest_point(client_, point.data(), maxDistance, &out) != 0;
  }
  bool castRay(const Ray& ray, float maxDistance, cs_cloth_point& out) const override {
    return cs_cast_ray(client_, ray.origin.data(), ray.direction.data(), maxDistance, &out) != 0;
  }

 private:
  const cs_client* client_;
};

// Box of cloths and of the scene's colliders except planes, down to the floor.
SceneBounds boundsOf(const cs_client* client);

}  // namespace clothstream::xr
