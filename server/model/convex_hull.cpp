// SPDX-License-Identifier: MIT
// Checks polyhedra and computes the planes of their faces.
#include "server/model/convex_hull.h"

#include <algorithm>
#include <map>
#include <utility>

namespace clothstream::model {
namespace {

using Face = std::vector<std::uint32_t>;
using Vec3d = Eigen::Vector3d;

struct FacePlane {
  Vec3d normal = Vec3d::Zero();
  double offset = 0;
};

std::optional<std::string> cornersProblem(const Face& face, std::size_t vertexCount) {
  if (face.size() < 3) return "has " + std::to_string(face.size()) + " corners; must have at least 3";
  for (std::size_t i = 0; i < face.size(); ++i) {
    if (face[i] >= vertexCount)
      return "names vertex " + std::to_string(face[i]) + "; there are " + std::to_string(vertexCount);
    if (std::find(face.begin(), face.begin() + static_cast<std::ptrdiff_t>(i), face[i]) !=
        face.begin() + static_cast<std::ptrdiff_t>(i))
      return "names vertex " + std::to_string(face[i]) + " twice";
  }
  return std::nullopt;
}

// Every edge of a closed surface belongs to two faces that traverse it in opposite directions.
std::optional<HullProblem> opening(const std::vector<Face>& faces) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> edges;
  for (std::size_t f = 0; f < faces.size(); ++f)
    for (std::size_t i = 0; i < faces[f].size(); ++i) {
      const std::uint32_t from = faces[f][i], to = faces[f][(i + 1) % faces[f].size()];
      if (!edges.try_emplace({from, to}, f).second)
        return HullProblem{f, "runs from vertex " + std::to_string(from) + " to " + std::to_string(to) +
                                  " as another face does: faces must be counter-clockwise seen from outside"};
    }
  for (const auto& [edge, face] : edges)
    if (!edges.contains({edge.second, edge.first}))
      return HullProblem{face, "has an edge from vertex " + std::to_string(edge.first) + " to " +
                                   std::to_string(edge.second) +
                                   " that no other face has: the hull must be closed"};
  return std::nullopt;
}

// Newell's method: twice the area times the normal, independent of the first corner.
FacePlane planeOf(const Face& face, const std::vector<Vec3>& vertices) {
  Vec3d normal = Vec3d::Zero(), centre = Vec3d::Zero();
  const Vec3d origin = vertices[face[0]].cast<double>();
  for (std::size_t i = 0; i < face.size(); ++i) {
    const Vec3d a = vertices[face[i]].cast<double>() - origin;
    const Vec3d b = vertices[face[(i + 1) % face.size()]].cast<double>() - origin;
    normal += a.cross(b);
    centre += vertices[face[i]].cast<double>() / static_cast<double>(face.size());
  }
  const double length = normal.norm();
  if (length > 0) normal /= length;
  return {normal, normal.dot(centre)};
}

Eigen::AlignedBox3d boxOf(const std::vector<Vec3>& vertices) {
  Eigen::AlignedBox3d box;
  for (const Vec3& vertex : vertices) box.extend(Vec3d(vertex.cast<double>()));
  return box;
}

}  // namespace

std::variant<ConvexHull, HullProblem> makeConvexHull(std::vector<Vec3> vertices, std::vector<Face> faces) {
  for (std::size_t f = 0; f < faces.size(); ++f)
    if (auto problem = cornersProblem(faces[f], vertices.size())) return HullProblem{f, std::move(*problem)};
  if (auto problem = opening(faces)) return std::move(*problem);

  const Eigen::AlignedBox3d box = boxOf(vertices);
  const double tolerance = box.isEmpty() ? 0 : kHullTolerance * box.diagonal().norm();
  std::vector<HalfSpace> planes;
  const auto add = [&](const FacePlane& plane) {
    const auto same = [&](const HalfSpace& other) {
      return (other.normal.cast<double>() - plane.normal).norm() < kHullTolerance &&
             std::abs(double{other.offset} - plane.offset) < tolerance;
    };
    if (std::ranges::none_of(planes, same))
      planes.push_back({plane.normal.cast<float>(), static_cast<float>(plane.offset)});
  };
  double deepest = 0;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const FacePlane plane = planeOf(faces[f], vertices);
    if (plane.normal.isZero()) return HullProblem{f, "has no area"};
    for (const std::uint32_t corner : faces[f])
      if (std::abs(plane.normal.dot(vertices[corner].cast<double>()) - plane.offset) > tolerance)
        return HullProblem{f, "is not plane: vertex " + std::to_string(corner) + " lies off it"};
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const double height = plane.normal.dot(vertices[v].cast<double>()) - plane.offset;
      if (height > tolerance)
        return HullProblem{f, "has vertex " + std::to_string(v) +
                                  " in front of it: the hull must be convex, and its faces counter-clockwise "
                                  "seen from outside"};
      deepest = std::max(deepest, -height);
    }
    add(plane);
  }
  if (!(deepest > 10 * tolerance)) return HullProblem{std::nullopt, "is flat: it has no inside"};
  for (int axis = 0; axis < 3; ++axis) {
    add({Vec3d::Unit(axis), box.max()[axis]});
    add({-Vec3d::Unit(axis), -box.min()[axis]});
  }
  return ConvexHull{std::move(vertices), std::move(faces), std::move(planes)};
}

}  // namespace clothstream::model
