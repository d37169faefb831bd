// SPDX-License-Identifier: MIT
#include "clients/core/touch/pick.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace clothstream::client {
namespace {

struct Triangle {
  Vector a, ab, ac;  // first corner, and the edges from it to the others
};

Triangle triangleAt(const ShownCloths& cloths, std::size_t index) {
  const std::uint32_t* corners = &cloths.triangles[3 * index];
  const Vector a = vectorAt(cloths.positions.data(), corners[0]);
  return {a, vectorAt(cloths.positions.data(), corners[1]) - a,
          vectorAt(cloths.positions.data(), corners[2]) - a};
}

// Barycentric coordinates of the second and third corner.
struct Coordinates {
  float second = 0, third = 0;
};

Vector at(const Triangle& triangle, const Coordinates& coordinates) {
  return triangle.a + coordinates.second * triangle.ab + coordinates.third * triangle.ac;
}

// Part of the way from the origin to `edge` at which the edge is nearest to `point`, 0 to 1.
float along(const Vector& edge, const Vector& point) {
  const float squared = dot(edge, edge);
  return squared > 0 ? std::clamp(dot(edge, point) / squared, 0.0f, 1.0f) : 0;
}

// The nearest point is that of the plane if it lies inside the triangle, otherwise the nearest of the three
// edges.
Coordinates nearestIn(const Triangle& triangle, const Vector& point) {
  const Vector from = point - triangle.a;
  const float bb = dot(triangle.ab, triangle.ab), bc = dot(triangle.ab, triangle.ac),
              cc = dot(triangle.ac, triangle.ac);
  const float b = dot(triangle.ab, from), c = dot(triangle.ac, from);
  if (const float area = bb * cc - bc * bc; area > 0) {
    const Coordinates inside{(cc * b - bc * c) / area, (bb * c - bc * b) / area};
    if (inside.second >= 0 && inside.third >= 0 && inside.second + inside.third <= 1) return inside;
  }
  const float opposite = along(triangle.ac - triangle.ab, from - triangle.ab);
  const Coordinates onEdges[] = {
      {along(triangle.ab, from), 0}, {0, along(triangle.ac, from)}, {1 - opposite, opposite}};
  const Coordinates* nearest = nullptr;
  float squared = std::numeric_limits<float>::infinity();
  for (const Coordinates& candidate : onEdges) {
    const Vector away = at(triangle, candidate) - point;
    if (nearest && dot(away, away) >= squared) continue;
    squared = dot(away, away);
    nearest = &candidate;
  }
  return *nearest;
}

// The method of Möller and Trumbore (1997). Returns nullopt if the ray misses the triangle or is parallel to
// it; otherwise the coordinates, and the distance in lengths of the direction.
struct Hit {
  Coordinates coordinates;
  float distance = 0;
};
std::optional<Hit> hit(const Triangle& triangle, const Vector& origin, const Vector& direction) {
  const Vector p = cross(direction, triangle.ac);
  const float determinant = dot(triangle.ab, p);
  if (determinant == 0) return std::nullopt;
  const Vector from = origin - triangle.a;
  const Vector q = cross(from, triangle.ab);
  const Hit found{{dot(from, p) / determinant, dot(direction, q) / determinant},
                  dot(triangle.ac, q) / determinant};
  const auto [second, third] = found.coordinates;
  const bool inside = second >= 0 && third >= 0 && second + third <= 1 && found.distance >= 0;
  return inside ? std::optional(found) : std::nullopt;
}

bool areFinite(const Vector& vector) {
  return std::isfinite(vector.x) && std::isfinite(vector.y) && std::isfinite(vector.z);
}

cs_cloth_point pointOf(std::size_t index, const Triangle& triangle, const Coordinates& coordinates,
                       float distance) {
  const Vector position = at(triangle, coordinates);
  return {.triangle = static_cast<std::uint32_t>(index),
          .second = coordinates.second,
          .third = coordinates.third,
          .position = {position.x, position.y, position.z},
          .distance = distance,
          .tick = 0};
}

}  // namespace

std::optional<cs_cloth_point> nearestPoint(const ShownCloths& cloths, const Vector& point,
                                           float maxDistance) {
  std::optional<cs_cloth_point> nearest;
  if (!areFinite(point) || !(maxDistance >= 0)) return nearest;
  float squared = maxDistance * maxDistance;
  for (std::size_t i = 0; i < cloths.triangles.size() / 3; ++i) {
    const Triangle triangle = triangleAt(cloths, i);
    const Coordinates coordinates = nearestIn(triangle, point);
    const Vector away = at(triangle, coordinates) - point;
    if (!(dot(away, away) <= squared)) continue;
    squared = dot(away, away);
    nearest = pointOf(i, triangle, coordinates, std::sqrt(squared));
  }
  return nearest;
}

std::optional<cs_cloth_point> castRay(const ShownCloths& cloths, const Vector& origin,
                                      const Vector& direction, float maxDistance) {
  std::optional<cs_cloth_point> first;
  const float scale = length(direction);
  if (!areFinite(origin) || !(scale > 0) || !std::isfinite(scale) || !(maxDistance >= 0)) return first;
  float farthest = maxDistance / scale;
  for (std::size_t i = 0; i < cloths.triangles.size() / 3; ++i) {
    const Triangle triangle = triangleAt(cloths, i);
    const std::optional<Hit> found = hit(triangle, origin, direction);
    if (!found || !(found->distance <= farthest)) continue;
    farthest = found->distance;
    first = pointOf(i, triangle, found->coordinates, farthest * scale);
  }
  return first;
}

}  // namespace clothstream::client
