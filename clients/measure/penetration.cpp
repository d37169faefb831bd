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

// Triangles of the largest hull that the protocol allows, 128 corners. A mesh that small may be a hull.
constexpr std::size_t kMaxHullTriangles = 252;
// A corner in front of a face by more than this share of the distances from the origin makes a hull a mesh.
constexpr double kFlat = 1e-3;
// Largest change of a capsule's radius along its length (scene.proto).
constexpr double kMostSlope = 0.99;

double squaredFromSegment(const Point& p, const Point& a, const Point& b) {
  const Point ab = minus(b, a), ap = minus(p, a);
  const double part = std::clamp(dot(ap, ab) / std::max(dot(ab, ab), 1e-300), 0.0, 1.0);
  const Point apart{ap[0] - part * ab[0], ap[1] - part * ab[1], ap[2] - part * ab[2]};
  return dot(apart, apart);
}

double squaredFromTriangle(const Point& p, const std::array<Point, 3>& t) {
  const Point normal = cross(minus(t[1], t[0]), minus(t[2], t[0]));
  bool isAbove = true;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Point &a = t[i], &b = t[(i + 1) % 3];
    isAbove = isAbove && dot(cross(normal, minus(b, a)), minus(p, a)) >= 0;
    nearest = std::min(nearest, squaredFromSegment(p, a, b));
  }
  const double height = dot(normal, minus(p, t[0]));
  return isAbove ? height * height / std::max(dot(normal, normal), 1e-300) : nearest;
}

// Van Oosterom and Strackee, "The solid angle of a plane triangle", 1983.
double solidAngle(const Point& p, const std::array<Point, 3>& t) {
  const Point a = minus(t[0], p), b = minus(t[1], p), c = minus(t[2], p);
  const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
  return 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

}  // namespace

Solid::Solid(const cs_collider& collider, std::span<const float> corners,
             std::span<const std::uint32_t> triangles)
    : shape_(collider.shape), radius_(double{collider.radius}), halfLength_(0.5 * double{collider.length}) {
  if (shape_ == CS_SHAPE_CAPSULE && collider.length > 0)
    slope_ = std::clamp((double{collider.top_radius} - radius_) / double{collider.length}, -kMostSlope,
                        kMostSlope);
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
  const auto isInFront = [&](const Face& face) {
    for (std::size_t i = 0; i < corners.size() / 3; ++i)
      if (const Point p = pointAt(corners, i);
          dot(face.normal, p) - face.offset > kFlat * std::sqrt(dot(p, p)))
        return true;
    return false;
  };
  if (triangles.size() / 3 <= kMaxHullTriangles && std::none_of(faces_.begin(), faces_.end(), isInFront))
    return;
  faces_.clear();
  low_.fill(std::numeric_limits<double>::infinity());
  high_.fill(-std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    triangles_.push_back({pointAt(corners, triangles[i]), pointAt(corners, triangles[i + 1]),
                          pointAt(corners, triangles[i + 2])});
    for (const Point& corner : triangles_.back())
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low_[axis] = std::min(low_[axis], corner[axis]);
        high_[axis] = std::max(high_[axis], corner[axis]);
      }
  }
}

double Solid::depthInMesh(const Point& p) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (p[axis] < low_[axis] || p[axis] > high_[axis]) return 0;
  double nearest = std::numeric_limits<double>::infinity(), angle = 0;
  for (const std::array<Point, 3>& triangle : triangles_) {
    nearest = std::min(nearest, squaredFromTriangle(p, triangle));
    angle += solidAngle(p, triangle);
  }
  const double wholeAngle = 4 * std::acos(-1.0);
  return (angle > wholeAngle / 2 ? 1 : -1) * std::sqrt(nearest);
}

double Solid::depthOf(const Point& point) const {
  const Point p =
      turnBack(orientation_, {point[0] - position_[0], point[1] - position_[1], point[2] - position_[2]});
  switch (shape_) {
    case CS_SHAPE_SPHERE:
      return radius_ - std::hypot(p[0], p[1], p[2]);
    case CS_SHAPE_CAPSULE: {
      const double nearest = p[1] + slope_ / std::sqrt(1 - slope_ * slope_) * std::hypot(p[0], p[2]);
      const double y = std::clamp(nearest, -halfLength_, halfLength_);
      return radius_ + slope_ * (y + halfLength_) - std::hypot(p[0], p[1] - y, p[2]);
    }
    case CS_SHAPE_PLANE:
      return -p[1];
    case CS_SHAPE_BOX: {
      double depth = std::numeric_limits<double>::infinity();
      for (std::size_t axis = 0; axis < 3; ++axis)
        depth = std::min(depth, halfSize_[axis] - std::abs(p[axis]));
      return depth;
    }
    default: {
      if (!triangles_.empty()) return depthInMesh(p);
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
