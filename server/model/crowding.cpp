// SPDX-License-Identifier: MIT
#include "server/model/crowding.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "server/model/cloth_skin.h"
#include "server/model/mesh.h"

namespace clothstream::model {
namespace {

// Cells along an axis, on both sides of the origin.
constexpr double kCells = 1 << 20;

// Width of a cell in the sum of two radii: SelfCollisionStage searches that far.
constexpr float kSearch = 1.25f;

std::uint64_t cellAlong(float place, float width) {
  const double cell = std::floor(double{place} / double{width});
  return static_cast<std::uint64_t>(std::clamp(cell, -kCells, kCells - 1) + kCells);
}

}  // namespace

double crowding(const std::vector<Vec3>& points, float width) {
  if (points.empty()) return 0;
  std::vector<std::uint64_t> cells;
  cells.reserve(points.size());
  for (const Vec3& point : points)
    cells.push_back(cellAlong(point.x(), width) << 42 | cellAlong(point.y(), width) << 21 |
                    cellAlong(point.z(), width));
  std::ranges::sort(cells);
  double squares = 0;
  for (auto first = cells.begin(); first != cells.end();) {
    const auto end = std::upper_bound(first, cells.end(), *first);
    const auto count = static_cast<double>(end - first);
    squares += count * count;
    first = end;
  }
  return squares / static_cast<double>(points.size());
}

SceneCrowding crowdingOf(const Scene& scene) {
  std::vector<Vec3> balls, middles;
  float radius = 0;
  double edges = 0;
  for (const Cloth& cloth : scene.cloths) {
    if (!cloth.selfCollision) continue;
    radius = std::max(radius, cloth.selfCollision->radius);
    const std::vector<Vec3> positions = startPositions(scene, cloth);
    balls.insert(balls.end(), positions.begin(), positions.end());
    if (!boundsMotion(cloth)) continue;
    for (const Triangle& triangle : clothTriangles(cloth)) {
      const Vec3 &a = positions[triangle[0]], &b = positions[triangle[1]], &c = positions[triangle[2]];
      middles.emplace_back((a + b + c) / 3);
      edges += double{(a - b).norm()} + double{(b - c).norm()} + double{(c - a).norm()};
    }
  }
  SceneCrowding result;
  if (radius > 0) result.balls = crowding(balls, 2 * kSearch * radius);
  const auto width =
      static_cast<float>(edges / (3 * static_cast<double>(std::max<std::size_t>(1, middles.size()))));
  if (width > 0) result.triangles = crowding(middles, width);
  return result;
}

}  // namespace clothstream::model
