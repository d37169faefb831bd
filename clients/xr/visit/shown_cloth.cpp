// SPDX-License-Identifier: MIT
#include "clients/xr/visit/shown_cloth.h"

#include <algorithm>

namespace clothstream::xr {
namespace {

// Colliders farther away are not part of what the user stands before, m. Vertices are nowhere farther.
constexpr float kFarthest = 1e6f;

// Radius of a ball around the middle of a collider that contains it; hulls are not measured.
float radiusOf(const cs_collider& collider) {
  switch (collider.shape) {
    case CS_SHAPE_SPHERE:
      return collider.radius;
    case CS_SHAPE_CAPSULE:
      return collider.length / 2 + std::max(collider.radius, collider.top_radius);
    case CS_SHAPE_BOX:
      return Eigen::Vector3f(collider.size).norm() / 2;
    default:
      return 0;
  }
}

}  // namespace

SceneBounds boundsOf(const cs_client* client) {
  const std::uint32_t count = cs_vertex_count(client);
  const float* const positions = cs_positions(client);
  if (count == 0) return {};
  SceneBounds bounds{Eigen::Vector3f(positions), Eigen::Vector3f(positions)};
  const auto add = [&](const Eigen::Vector3f& middle, float radius) {
    bounds.least = bounds.least.cwiseMin(middle - Eigen::Vector3f::Constant(radius));
    bounds.most = bounds.most.cwiseMax(middle + Eigen::Vector3f::Constant(radius));
  };
  for (std::uint32_t i = 0; i < count; ++i) add(Eigen::Vector3f(positions + 3 * std::size_t{i}), 0);
  float floor = std::min(bounds.least.y(), 0.f);
  for (std::uint32_t i = 0; i < cs_collider_count(client); ++i) {
    cs_collider collider;
    if (!cs_get_collider(client, i, &collider) || collider.participant_id != 0) continue;
    const Eigen::Vector3f middle(collider.position);
    const float radius = radiusOf(collider);
    if (!(middle.cwiseAbs().maxCoeff() + radius < kFarthest)) continue;
    if (collider.shape == CS_SHAPE_PLANE) {
      floor = middle.y();
    } else {
      add(middle, radius);
    }
  }
  bounds.least.y() = floor;
  return bounds;
}

}  // namespace clothstream::xr
