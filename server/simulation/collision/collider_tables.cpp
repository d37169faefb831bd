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
// Reach of an unbounded shape. The square of infinity would not be usable in kernels.
constexpr float kFar = 1e15f;

// Appends the planes of the shape. `firstPlane` is the texel of the first plane of all shapes.
shared::ShapeRecord shapeRecord(const model::Shape& shape, const SolidTables& solids, std::size_t firstPlane,
                                std::vector<vec4>& planes) {
  const auto first = static_cast<float>(firstPlane + planes.size());
  return std::visit(
      model::ShapeVisitor{
          [](const model::Sphere& sphere) { return shared::roundShape(sphere.radius, 0, 0); },
          [](const model::Capsule& capsule) {
            return shared::roundShape(capsule.radius, capsule.length / 2, model::slopeOf(capsule));
          },
          [&](const model::Plane&) {
            planes.push_back({0, 1, 0, 0});
            return shared::planesShape(first, 1);
          },
          [](const model::Box& box) { return shared::boxShape(vectorOf(box.size / 2)); },
          [&](const model::Hull& hull) {
            for (const model::HalfSpace& plane : hull->planes)
              planes.push_back(texel(plane.normal, plane.offset));
            return shared::planesShape(first, static_cast<float>(hull->planes.size()));
          },
          [&](const model::Solid& solid) {
            const std::size_t index = solids.indexOf(solid);
            return shared::solidShape(static_cast<float>(solids.places[index]), solids.motions[index]);
          }},
      shape);
}

float reachOf(const model::Shape& shape, const SolidTables& solids) {
  const auto* solid = std::get_if<model::Solid>(&shape);
  return solid == nullptr ? model::reachOf(shape) : solids.reaches[solids.indexOf(*solid)];
}

shared::ColliderRecord recordOf(const MovingCollider& collider, const SolidTables& solids,
                                std::size_t firstPlane, std::vector<vec4>& planes) {
  const model::Quaternion& from = collider.start.orientation;
  const model::Quaternion& to = collider.end.orientation;
  const float sign = from.dot(to) < 0 ? -1.0f : 1.0f;
  return {.position = vectorOf(collider.start.position),
          .reach = std::min(reachOf(collider.shape, solids), kFar),
          .motion = vectorOf(collider.end.position - collider.start.position),
          .friction = collider.friction,
          .orientation = texel(from),
          .orientationChange = {sign * to.x() - from.x(), sign * to.y() - from.y(), sign * to.z() - from.z(),
                                sign * to.w() - from.w()},
          .shape = shapeRecord(collider.shape, solids, firstPlane, planes)};
}

shared::ColliderBounds boundsOf(const MovingCollider& collider, float reach) {
  const model::Vec3& a = collider.start.position;
  const model::Vec3& b = collider.end.position;
  const model::Vec3 reaches = model::Vec3::Constant(reach);
  return {.low = vectorOf(a.cwiseMin(b) - reaches),
          .farthestMotion = (b - a).norm(),
          .high = vectorOf(a.cwiseMax(b) + reaches),
          .reserved = 0};
}

// Bounds of both.
shared::ColliderBounds unite(const shared::ColliderBounds& a, const shared::ColliderBounds& b) {
  return {.low = {std::min(a.low.x, b.low.x), std::min(a.low.y, b.low.y), std::min(a.low.z, b.low.z)},
          .farthestMotion = std::max(a.farthestMotion, b.farthestMotion),
          .high = {std::max(a.high.x, b.high.x), std::max(a.high.y, b.high.y), std::max(a.high.z, b.high.z)},
          .reserved = 0};
}

}  // namespace

void fill(ColliderTables& tables, std::span<const MovingCollider* const> colliders,
          const SolidTables& solids) {
  assert(colliders.size() <= kMaxColliders);
  tables.records.clear();
  tables.planes.clear();
  for (const MovingCollider* const collider : colliders)
    tables.records.push_back(recordOf(*collider, solids, kRecordTexels * colliders.size(), tables.planes));
  assert(tables.planes.size() <= kMaxColliderPlanes);

  const auto others = static_cast<std::size_t>(
      std::ranges::find_if(colliders, [](const MovingCollider* collider) { return isSolid(*collider); }) -
      colliders.begin());
  const std::size_t groups = (others + shared::kColliderGroup - 1) / shared::kColliderGroup;
  tables.bounds.clear();
  tables.bounds.resize(groups);
  for (std::size_t i = 0; i < others; ++i) {
    const shared::ColliderBounds own = boundsOf(*colliders[i], tables.records[i].reach);
    shared::ColliderBounds& group = tables.bounds[i / shared::kColliderGroup];
    group = i % shared::kColliderGroup == 0 ? own : unite(group, own);
    tables.bounds.push_back(own);
  }
}

}  // namespace clothstream::simulation
