// SPDX-License-Identifier: MIT
#include "server/scene/hand_limits.h"

#include <algorithm>

namespace clothstream::scene {

float leastRadius(const model::Shape& shape) {
  if (const auto* box = std::get_if<model::Box>(&shape)) return box->size.minCoeff() / 2;
  if (const auto* capsule = std::get_if<model::Capsule>(&shape)) return capsule->radius;
  if (const auto* sphere = std::get_if<model::Sphere>(&shape)) return sphere->radius;
  return 0;
}

float largestRadius(const model::Shape& shape) {
  if (const auto* box = std::get_if<model::Box>(&shape)) return box->size.norm() / 2;
  if (const auto* capsule = std::get_if<model::Capsule>(&shape)) return capsule->radius + capsule->length / 2;
  return leastRadius(shape);
}

model::Shape thinned(const model::Shape& shape, float depth) {
  model::Shape thinner = shape;
  if (leastRadius(shape) <= depth) return thinner;
  if (auto* box = std::get_if<model::Box>(&thinner)) {
    Eigen::Index thinnest = 0;
    box->size.minCoeff(&thinnest);
    box->size[thinnest] = 2 * depth;
  } else if (float* radius = model::radiusOf(thinner)) {
    *radius = depth;
  }
  return thinner;
}

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
