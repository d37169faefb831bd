// SPDX-License-Identifier: MIT
#include "server/reference/surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace clothstream::reference {
namespace {

using Vec3 = Eigen::Vector3d;
using SurfaceCorners = std::array<Vec3, 3>;

// As in shaders/collision/surface.h and solid_nearest.glsl.
constexpr double kSurfaceSeam = 2e-4, kOnSurface = 1e-4;  // m
constexpr double kSamePlace = 1e-9;                       // m, difference of points

SurfaceCorners cornersOf(const model::Surface& surface, std::size_t t) {
  const model::TriangleCorners& triangle = surface.triangles[t];
  return {surface.vertices[triangle[0]].cast<double>(), surface.vertices[triangle[1]].cast<double>(),
          surface.vertices[triangle[2]].cast<double>()};
}

Vec3 normalOf(const SurfaceCorners& t) {
  return (t[1] - t[0]).cross(t[2] - t[0]).normalized();
}

Vec3 nearestOfEdge(const Vec3& p, const Vec3& a, const Vec3& b) {
  return a + std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0) * (b - a);
}

// The foot of the perpendicular if it is in the triangle, else the nearest point of the edges.
Vec3 nearestOfTriangle(const Vec3& p, const SurfaceCorners& t) {
  const Vec3 normal = normalOf(t), foot = p - normal.dot(p - t[0]) * normal;
  bool inside = true;
  Vec3 nearest = t[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = t[i], &b = t[(i + 1) % 3], onEdge = nearestOfEdge(p, a, b);
    inside = inside && normal.cross(b - a).dot(foot - a) >= 0;
    if ((p - onEdge).squaredNorm() < (p - nearest).squaredNorm()) nearest = onEdge;
  }
  return inside ? foot : nearest;
}

// Number of the corner of a triangle that is at a point; nothing elsewhere.
std::optional<std::size_t> cornerAt(const SurfaceCorners& t, const Vec3& point) {
  for (std::size_t k = 0; k < 3; ++k)
    if ((point - t[k]).norm() < kSamePlace) return k;
  return std::nullopt;
}

double distanceFromRim(const SurfaceCorners& t, std::uint8_t rims, const Vec3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k)
    if ((rims >> k & 1) != 0) least = std::min(least, (p - nearestOfEdge(p, t[k], t[(k + 1) % 3])).norm());
  return least;
}

// Sum of the normals of all triangles that have the point, each weighted by its angle there.
Vec3 pseudonormalAt(const model::Surface& surface, const Vec3& point) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const SurfaceCorners corners = cornersOf(surface, t);
    if ((nearestOfTriangle(point, corners) - point).norm() >= kSamePlace) continue;
    double angle = 1;
    if (const std::optional<std::size_t> corner = cornerAt(corners, point)) {
      const std::size_t k = *corner;
      angle = std::acos(std::clamp((corners[(k + 1) % 3] - corners[k])
                                       .normalized()
                                       .dot((corners[(k + 2) % 3] - corners[k]).normalized()),
                                   -1.0, 1.0));
    }
    sum += angle * normalOf(corners);
  }
  return sum;
}

std::optional<double> crossingOf(const SurfaceCorners& t, bool twoSided, const Vec3& from, const Vec3& to) {
  const Vec3 normal = normalOf(t);
  const double start = normal.dot(from - t[0]), end = normal.dot(to - t[0]);
  const bool leaves = start >= 0 && end < 0, returns = twoSided && start < 0 && end >= 0;
  if (!leaves && !returns) return std::nullopt;
  const double part = std::abs(start) / (std::abs(start) + std::abs(end));
  const Vec3 place = from + part * (to - from);
  if ((place - nearestOfTriangle(place, t)).norm() > kSurfaceSeam) return std::nullopt;
  return part;
}

struct OwnContact {
  Vec3 normal;
  double depth;
  double part;  // share of the path at the crossing; 2 without one
};

// All in the frame of the surface.
std::optional<OwnContact> touchSurface(const PlacedSurface& placed, double thickness, double pushed,
                                       const Vec3& from, const Vec3& to) {
  const model::Surface& surface = *placed.surface;
  double firstPart = 2, startDistance = std::numeric_limits<double>::infinity();
  double least = std::numeric_limits<double>::infinity(), fromRim = least;
  std::size_t crossed = 0;
  Vec3 point = Vec3::Zero();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const SurfaceCorners corners = cornersOf(surface, t);
    const std::optional<double> part = crossingOf(corners, placed.twoSided, from, to);
    if (part && *part < firstPart) {
      firstPart = *part;
      crossed = t;
    }
    fromRim = std::min(fromRim, distanceFromRim(corners, surface.rims[t], to));
    startDistance = std::min(startDistance, (from - nearestOfTriangle(from, corners)).norm());
    const Vec3 here = nearestOfTriangle(to, corners);
    if ((to - here).norm() < least) {
      least = (to - here).norm();
      point = here;
    }
  }
  const double target = std::min(thickness, startDistance + pushed);
  if (firstPart <= 1) {
    const SurfaceCorners corners = cornersOf(surface, crossed);
    const Vec3 normal = normalOf(corners), side = normal.dot(from - corners[0]) >= 0 ? normal : Vec3(-normal);
    return OwnContact{side, target - side.dot(to - corners[0]), firstPart};
  }
  const double depthBound = placed.twoSided ? 0 : double{model::kSurfaceDepth};
  if (least >= std::max({thickness, depthBound, kSurfaceSeam})) return std::nullopt;
  const Vec3 outwards = pseudonormalAt(surface, point).normalized();
  const bool touches = least < kOnSurface;
  const bool inFront = (touches ? from - point : to - point).dot(outwards) >= 0;
  const Vec3 away = touches ? (inFront ? outwards : Vec3(-outwards)) : Vec3((to - point) / least);
  const double distance = touches ? 0 : least;
  if (placed.twoSided || inFront) return OwnContact{away, target - distance, 2};
  if (fromRim < depthBound || distance >= depthBound) return std::nullopt;
  const double start = -away.dot(from - point) + pushed;
  return OwnContact{-away, std::min(thickness, start) + distance, 2};
}

}  // namespace

std::optional<SurfaceContact> touchSurfaces(std::span<const PlacedSurface> surfaces, double thickness,
                                            double seconds, const Vec3& from, const Vec3& to) {
  SurfaceContact best{Vec3::UnitY(), 0, 0};
  double part = 2;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Pose& pose = surfaces[i].pose;
    const auto inFrame = [&](const Vec3& p) {
      return Vec3(pose.orientation.conjugate() * (p - pose.position));
    };
    const std::optional<OwnContact> found = touchSurface(
        surfaces[i], thickness, double{model::kSurfacePushSpeed} * seconds, inFrame(from), inFrame(to));
    if (!found || (found->part > 1 && part <= 1)) continue;
    if (found->part <= 1 ? found->part >= part : found->depth <= best.depth) continue;
    best = {pose.orientation * found->normal, found->depth, i};
    part = found->part;
  }
  return best.depth > 0 ? std::optional(best) : std::nullopt;
}

bool crossesSurfaces(std::span<const PlacedSurface> surfaces, const Vec3& from, const Vec3& to) {
  return std::ranges::any_of(surfaces, [&](const PlacedSurface& placed) {
    const auto inFrame = [&](const Vec3& p) {
      return Vec3(placed.pose.orientation.conjugate() * (p - placed.pose.position));
    };
    const Vec3 start = inFrame(from), end = inFrame(to);
    for (std::size_t t = 0; t < placed.surface->triangles.size(); ++t)
      if (crossingOf(cornersOf(*placed.surface, t), placed.twoSided, start, end)) return true;
    return false;
  });
}

}  // namespace clothstream::reference
