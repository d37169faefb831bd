// SPDX-License-Identifier: MIT
#include "server/scene/hand_limits.h"

#include <algorithm>

namespace clothstream::scene {

float wayOf(float radius, const model::Pose& from, const model::Pose& to) {
  return (to.position - from.position).norm() + radius * to.orientation.angularDistance(from.orientation);
}

model::Pose towards(float radius, const model::Pose& from, const model::Pose& to, float step) {
  const float way = wayOf(radius, from, to);
  if (way <= step) return to;
  const float share = step / way;
  return {from.position + share * (to.position - from.position),
          from.orientation.slerp(share, to.orientation)};
}

float maxGrabForce(const model::Scene& scene) {
  float mass = 0;
  for (const model::Cloth& cloth : scene.cloths) mass += cloth.mass;
  const float seconds = std::max(kPullSeconds, static_cast<float>(scene.tickSeconds()));
  return std::max(kLeastMaxForce, mass * kMaxHandSpeed / seconds);
}

}  // namespace clothstream::scene
