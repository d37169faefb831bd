// SPDX-License-Identifier: MIT
#include "clients/measure/penetration.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace clothstream::measure {
namespace {

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Turns a vector by the inverse of a unit quaternion.
Point turnBack(const std::array<double, 4>& q, const Point& v) {
  const Point axis{-q[0], -q[1], -q[2]};
  Point t = cross(axis, v);
  for (double& number : t) number *= 2;
  const Point u = cross(axis, t);
  return {v[0] + q[3] * t[0] + u[0], v[1] + q[3] * t[1] + u[1], v[2] + q[3] * t[2] + u[2]};
}

}  // namespace

Solid::Solid(const cs_collider& collider, std::span<const float> corners,
             std::span<const std::uint32_t> triangles)
    : shape_(collider.shape), radius_(double{collider.radius}), halfLength_(0.5 * double{collider.length}) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    position_[axis] = double{collider.position[axis]};
    halfSize_[axis] = 0.5 * double{collider.size[axis]};
  }
  double square = 0;
  for (const float number : collider.orientation) square += double{number} * double{number};
  const double length = std::sqrt(square);
  for (std::size_t i = 0; i < 4; ++i)
    orientation_[i] = length > 0 ? double{collider.orientation[i]} / length : (i == 3 ? 1 : 0);
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const Point a = pointAt(corners, triangles[i]), b = pointAt(corners, triangles[i + 1]),
                c = pointAt(corners, triangles[i + 2]);
    Point normal = cross({b[0] - a[0], b[1] - a[1], b[2] - a[2]}, {c[0] - a[0], c[1] - a[1], c[2] - a[2]});
    const double size = std::sqrt(dot(normal, normal));
    if (!(size > 0)) continue;
    for (double& number : normal) number /= size;
    faces_.push_back({normal, dot(normal, a)});
  }
}

double Solid::depthOf(const Point& point) const {
  const Point p =
      turnBack(orientation_, {point[0] - position_[0], point[1] - position_[1], point[2] - position_[2]});
  switch (shape_) {
    case CS_SHAPE_SPHERE:
      return radius_ - std::hypot(p[0], p[1], p[2]);
    case CS_SHAPE_CAPSULE:
      return radius_ - std::hypot(p[0], p[1] - std::clamp(p[1], -halfLength_, halfLength_), p[2]);
    case CS_SHAPE_PLANE:
      return -p[1];
    case CS_SHAPE_BOX: {
      double depth = std::numeric_limits<double>::infinity();
      for (std::size_t axis = 0; axis < 3; ++axis)
        depth = std::min(depth, halfSize_[axis] - std::abs(p[axis]));
      return depth;
    }
    default: {
      if (faces_.empty()) return 0;
      double depth = std::numeric_limits<double>::infinity();
      for (const Face& face : faces_) depth = std::min(depth, face.offset - dot(face.normal, p));
      return depth;
    }
  }
}

std::vector<Solid> solidsOf(const cs_client* client) {
  std::vector<Solid> solids;
  cs_collider collider;
  for (std::uint32_t i = 0; cs_get_collider(client, i, &collider) != 0; ++i) {
    std::uint32_t corners = 0, indices = 0;
    const std::uint32_t* triangles = nullptr;
    const float* const hull = cs_get_hull(client, i, &corners, &triangles, &indices);
    solids.emplace_back(collider, std::span(hull, hull == nullptr ? 0 : 3 * std::size_t{corners}),
                        std::span(triangles, hull == nullptr ? 0 : indices));
  }
  return solids;
}

double penetrationOf(std::span<const Solid> solids, std::span<const float> positions, std::uint32_t first,
                     std::uint32_t count) {
  double deepest = 0;
  for (const Solid& solid : solids)
    for (std::uint32_t i = first; i < first + count; ++i)
      deepest = std::max(deepest, solid.depthOf(pointAt(positions, i)));
  return deepest;
}

}  // namespace clothstream::measure
