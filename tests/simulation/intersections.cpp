// SPDX-License-Identifier: MIT
// Counts the places where a cloth passes through itself or through another cloth.
#include "tests/simulation/intersections.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <vector>

#include "server/model/mesh.h"

namespace clothstream::tests {
namespace {

using Point = Eigen::Vector3d;

// Six times the volume of a tetrahedron: which side of abc d lies on.
double side(const Point& a, const Point& b, const Point& c, const Point& d) {
  return (b - a).cross(c - a).dot(d - a);
}

bool pierces(const std::array<Point, 2>& edge, const std::array<Point, 3>& corners) {
  const auto& [p, q] = edge;
  const auto& [a, b, c] = corners;
  if (side(a, b, c, p) * side(a, b, c, q) >= 0) return false;
  const double u = side(p, q, a, b), v = side(p, q, b, c), w = side(p, q, c, a);
  return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

}  // namespace

std::size_t intersections(const model::Scene& scene, std::span<const model::Vec3> positions) {
  std::vector<model::Triangle> triangles;
  std::set<std::array<std::uint32_t, 2>> edges;
  std::uint32_t first = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    for (model::Triangle triangle : model::clothTriangles(cloth)) {
      for (std::uint32_t& node : triangle) node += first;
      triangles.push_back(triangle);
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [a, b] = std::minmax(triangle[i], triangle[(i + 1) % 3]);
        edges.insert({a, b});
      }
    }
    first += cloth.nodeCount();
  }
  std::size_t count = 0;
  for (const model::Triangle& triangle : triangles) {
    const auto at = [&](std::size_t i) { return positions[triangle[i]].cast<double>().eval(); };
    const std::array<Point, 3> corners{at(0), at(1), at(2)};
    const Point low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
    const Point high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
    for (const auto& [a, b] : edges) {
      const Point p = positions[a].cast<double>(), q = positions[b].cast<double>();
      if ((p.cwiseMax(q).array() < low.array()).any() || (p.cwiseMin(q).array() > high.array()).any())
        continue;
      if (std::ranges::find(triangle, a) != triangle.end() ||
          std::ranges::find(triangle, b) != triangle.end())
        continue;
      count += pierces({p, q}, corners) ? 1 : 0;
    }
  }
  return count;
}

}  // namespace clothstream::tests
