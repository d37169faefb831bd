// SPDX-License-Identifier: MIT
#include "server/model/distance_grid.h"

#include <algorithm>
#include <cmath>

namespace clothstream::model {
namespace {

struct Sides {
  Vec3 low, high;
};

Sides sidesOf(const ClosedMesh& mesh) {
  Sides sides{mesh.vertices.front(), mesh.vertices.front()};
  for (const Vec3& vertex : mesh.vertices) {
    sides.low = sides.low.cwiseMin(vertex);
    sides.high = sides.high.cwiseMax(vertex);
  }
  return sides;
}

}  // namespace

DistanceGrid distanceGridOf(const ClosedMesh& mesh, float cell) {
  const Sides sides = sidesOf(mesh);
  const float margin = 2 * cell + kDistanceMargin;
  DistanceGrid grid{.origin = sides.low - Vec3::Constant(margin), .cell = cell};
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = std::ceil((double{sides.high[axis]} - sides.low[axis] + 2.0 * margin) / cell);
    // Far more than is allowed, and still a number.
    grid.counts[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(std::min(cells, 1e6)) + 1;
  }
  return grid;
}

float thinnestSide(const ClosedMesh& mesh) {
  const Sides sides = sidesOf(mesh);
  return (sides.high - sides.low).minCoeff();
}

}  // namespace clothstream::model
