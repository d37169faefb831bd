// SPDX-License-Identifier: MIT
// Records and bounds of colliders.
#include "server/simulation/collision/collider_tables.h"

#include <algorithm>
#include <cassert>

#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using shared::vec4;

constexpr std::size_t kRecordTexels = sizeof(shared::ColliderRecord) / sizeof(vec4);
// Instead of infinity, whose square kernels would have to avoid.
constexpr float kFar = 1e15f;

// Appends the planes that the shape needs; `firstPlane` is the texel of the first of all.
vec4 shapeTexel(const model::Shape& shape, std::size_t firstPlane, std::vector<vec4>& planes) {
  const auto first = static_cast<float>(firstPlane + planes.size());
  return std::visit(
      model::ShapeVisitor{[](const model::Sphere& sphere) -> vec4 {
                            return {shared::kRoundShape, sphere.radius, 0, 0};
                          },
                          [](const model::Capsule& capsule) -> vec4 {
                            return {shared::kRoundShape, capsule.radius, capsule.length / 2, 0};
                          },
                          [&](const model::Plane&) -> vec4 {
                            planes.push_back({0, 1, 0, 0});
                            return {shared::kPlanesShape, first, 1, 0};
                          },
                          [](const model::Box& box) -> vec4 {
                            return {shared::kBoxShape, box.size.x() / 2, box.size.y() / 2, box.size.z() / 2};
                          },
                          [&](const model::Hull& hull) -> vec4 {
                            for (const model::HalfSpace& plane : hull->planes)
                              planes.push_back(texel(plane.normal, plane.offset));
                            return {shared::kPlanesShape, first, static_cast<float>(hull->planes.size()), 0};
                          }},
      shape);
}

shared::ColliderRecord recordOf(const MovingCollider& collider, std::size_t firstPlane,
                                std::vector<vec4>& planes) {
  const model::Quaternion& from = collider.start.orientation;
  const model::Quaternion& to = collider.end.orientation;
  const float sign = from.dot(to) < 0 ? -1.0f : 1.0f;
  return {.start = texel(collider.start.position, std::min(model::reachOf(collider.shape), kFar)),
          .motion = texel(collider.end.position - collider.start.position, collider.friction),
          .turned = {from.x(), from.y(), from.z(), from.w()},
          .turn = {sign * to.x() - from.x(), sign * to.y() - from.y(), sign * to.z() - from.z(),
                   sign * to.w() - from.w()},
          .shape = shapeTexel(collider.shape, firstPlane, planes)};
}

shared::ColliderBounds boundsOf(const MovingCollider& collider, float reach) {
  const model::Vec3& a = collider.start.position;
  const model::Vec3& b = collider.end.position;
  const model::Vec3 reaches = model::Vec3::Constant(reach);
  return {texel(a.cwiseMin(b) - reaches, (b - a).norm()), texel(a.cwiseMax(b) + reaches, 0)};
}

vec4 lower(const vec4& a, const vec4& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z), std::max(a.w, b.w)};
}

vec4 upper(const vec4& a, const vec4& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z), 0};
}

}  // namespace

void fill(ColliderTables& tables, std::span<const MovingCollider> colliders) {
  assert(colliders.size() <= kMaxColliders);
  tables.records.clear();
  tables.planes.clear();
  for (const MovingCollider& collider : colliders)
    tables.records.push_back(recordOf(collider, kRecordTexels * colliders.size(), tables.planes));
  assert(tables.planes.size() <= kMaxColliderPlanes);

  const std::size_t groups = (colliders.size() + shared::kColliderGroup - 1) / shared::kColliderGroup;
  tables.bounds.clear();
  tables.bounds.resize(groups);
  for (std::size_t i = 0; i < colliders.size(); ++i) {
    const shared::ColliderBounds own = boundsOf(colliders[i], tables.records[i].start.w);
    shared::ColliderBounds& group = tables.bounds[i / shared::kColliderGroup];
    group = i % shared::kColliderGroup == 0
                ? own
                : shared::ColliderBounds{lower(group.low, own.low), upper(group.high, own.high)};
    tables.bounds.push_back(own);
  }
}

}  // namespace clothstream::simulation
