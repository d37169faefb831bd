// SPDX-License-Identifier: MIT
#include "server/reference/solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server/model/distance_grid.h"

namespace clothstream::reference {
namespace {

using Vec3 = Eigen::Vector3d;
using Corners = std::array<Vec3, 3>;

constexpr double kTouching = 1e-4;  // m
constexpr double kSame = 1e-9;      // m, difference of distances from the same point

Corners cornersOf(const model::ClosedMesh& mesh, const model::TriangleCorners& triangle) {
  return {mesh.vertices[triangle[0]].cast<double>(), mesh.vertices[triangle[1]].cast<double>(),
          mesh.vertices[triangle[2]].cast<double>()};
}

Vec3 unitNormal(const Corners& t) {
  return (t[1] - t[0]).cross(t[2] - t[0]).normalized();
}

Vec3 nearestOnSegment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double part = (p - a).dot(b - a) / (b - a).squaredNorm();
  return a + std::clamp(part, 0.0, 1.0) * (b - a);
}

// The foot of the perpendicular if it is in the triangle, else the nearest point of the edges.
Vec3 nearestOnTriangle(const Vec3& p, const Corners& t) {
  const Vec3 normal = unitNormal(t);
  const Vec3 foot = p - normal.dot(p - t[0]) * normal;
  bool inside = true;
  Vec3 nearest = t[0];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = t[i], &b = t[(i + 1) % 3];
    inside = inside && normal.cross(b - a).dot(foot - a) >= 0;
    const Vec3 onEdge = nearestOnSegment(p, a, b);
    if ((p - onEdge).squaredNorm() < (p - nearest).squaredNorm()) nearest = onEdge;
  }
  return inside ? foot : nearest;
}

// Angle of the triangle around one of its points: all around in its middle, half at an edge.
double angleAt(const Corners& t, const Vec3& point) {
  const double pi = std::acos(-1.0);
  for (std::size_t i = 0; i < 3; ++i)
    if ((point - t[i]).norm() < kSame)
      return std::acos(std::clamp(
          (t[(i + 1) % 3] - t[i]).normalized().dot((t[(i + 2) % 3] - t[i]).normalized()), -1.0, 1.0));
  for (std::size_t i = 0; i < 3; ++i)
    if ((point - nearestOnSegment(point, t[i], t[(i + 1) % 3])).norm() < kSame) return pi;
  return 2 * pi;
}

// Barycentric coordinates of a point of the triangle: shares of its area.
std::array<double, 3> weightsOf(const Corners& t, const Vec3& point) {
  const Vec3 area = (t[1] - t[0]).cross(t[2] - t[0]);
  std::array<double, 3> weights{};
  for (std::size_t i = 0; i < 3; ++i)
    weights[i] = (t[(i + 1) % 3] - point).cross(t[(i + 2) % 3] - point).dot(area) / area.squaredNorm();
  return weights;
}

double solidAngle(const Vec3& p, const Corners& t) {
  const Vec3 a = t[0] - p, b = t[1] - p, c = t[2] - p;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace

NearestPoint nearestOn(const model::ClosedMesh& mesh, const Vec3& p) {
  NearestPoint nearest;
  double least = std::numeric_limits<double>::infinity(), angle = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Corners corners = cornersOf(mesh, mesh.triangles[t]);
    const Vec3 point = nearestOnTriangle(p, corners);
    angle += solidAngle(p, corners);
    if ((p - point).norm() < least) {
      least = (p - point).norm();
      nearest.point = point;
      nearest.triangle = t;
    }
  }
  nearest.weights = weightsOf(cornersOf(mesh, mesh.triangles[nearest.triangle]), nearest.point);
  const double sign = angle > 2 * std::acos(-1.0) ? -1 : 1;
  nearest.distance = sign * least;
  nearest.normal = sign * (p - nearest.point) / std::max(least, 1e-300);
  if (least >= kTouching) return nearest;
  nearest.normal = Vec3::Zero();
  for (const model::TriangleCorners& triangle : mesh.triangles) {
    const Corners corners = cornersOf(mesh, triangle);
    if ((nearestOnTriangle(p, corners) - nearest.point).norm() < kSame)
      nearest.normal += angleAt(corners, nearest.point) * unitNormal(corners);
  }
  nearest.normal.normalize();
  return nearest;
}

NearestPoint nearestInGrid(const model::ClosedMesh& mesh, const Vec3& p) {
  const model::DistanceGrid grid = model::distanceGridOf(mesh, mesh.distanceCell);
  const Vec3 origin = grid.origin.cast<double>();
  const double cell = grid.cell;
  Vec3 beyond;  // from the nearest point of the grid
  std::array<double, 3> first{}, part{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    const double cells = grid.counts[k] - 1;
    const double free = (p[axis] - origin[axis]) / cell, place = std::clamp(free, 0.0, cells);
    first[k] = std::min(std::floor(place), cells - 1);
    part[k] = place - first[k];
    beyond[axis] = cell * (free - place);
  }
  double distance = 0;
  Vec3 slope = Vec3::Zero();
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 at;
    std::array<double, 3> weight{}, sign{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      const bool upper = (corner >> k & 1) != 0;
      at[axis] = origin[axis] + cell * (first[k] + (upper ? 1 : 0));
      weight[k] = upper ? part[k] : 1 - part[k];
      sign[k] = upper ? 1 : -1;
    }
    const double sample = nearestOn(mesh, at).distance;
    distance += weight[0] * weight[1] * weight[2] * sample;
    slope += sample * Vec3(sign[0] * weight[1] * weight[2], weight[0] * sign[1] * weight[2],
                           weight[0] * weight[1] * sign[2]);
  }
  Vec3 normal = slope.normalized();
  if (beyond.norm() > 0) {
    const Vec3 way = distance * normal + beyond;
    distance = std::hypot(distance, beyond.norm());
    normal = way / distance;
  }
  return {.distance = distance, .point = p - distance * normal, .normal = normal};
}

std::optional<Crossing> firstCrossing(const model::ClosedMesh& mesh, const Vec3& from, const Vec3& to) {
  std::optional<Crossing> first;
  for (const model::TriangleCorners& triangle : mesh.triangles) {
    const Corners t = cornersOf(mesh, triangle);
    const Vec3 normal = unitNormal(t);
    const double before = normal.dot(from - t[0]), after = normal.dot(to - t[0]);
    if (before < 0 || after >= 0) continue;
    const double part = before / (before - after);
    if (first && part >= first->part) continue;
    const Vec3 point = from + part * (to - from);
    bool inside = true;
    for (std::size_t i = 0; i < 3; ++i)
      inside = inside && normal.cross(t[(i + 1) % 3] - t[i]).dot(point - t[i]) >= -kSame;
    if (inside) first = Crossing{part, normal};
  }
  return first;
}

model::ClosedMesh between(const model::ClosedMesh& from, const model::ClosedMesh& to, double part) {
  model::ClosedMesh mesh = from;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    mesh.vertices[i] += static_cast<float>(part) * (to.vertices[i] - from.vertices[i]);
  return mesh;
}

model::ClosedMesh moved(const model::ClosedMesh& mesh, std::span<const model::Pose> start,
                        std::span<const model::Pose> end, double progress) {
  const auto from = model::jointTransforms(*mesh.skin, start), to = model::jointTransforms(*mesh.skin, end);
  model::ClosedMesh result = mesh;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const model::VertexJoints& joints = mesh.skin->vertices[i];
    const Vec3 rest = mesh.vertices[i].cast<double>();
    const Vec3 a = model::skinned(joints, from, rest), b = model::skinned(joints, to, rest);
    result.vertices[i] = (a + progress * (b - a)).cast<float>();
  }
  return result;
}

}  // namespace clothstream::reference
