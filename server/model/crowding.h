// SPDX-License-Identifier: MIT
// How densely points lie, for the price of searches for pairs.
#pragma once

#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

// Mean number of points in the cell of a point, itself included: cells are cubes of this width (m, above 0).
// 0 without points. Points farther out than a million cells share the outermost ones. Takes n log n time.
double crowding(const std::vector<Vec3>& points, float width);

// Crowding of a scene at its start.
struct SceneCrowding {
  double balls = 0;  // nodes of the cloths with self-collision, in cells of the search for their neighbours
  double triangles = 0;  // middles of those that nothing passes through, in cells as wide as their edges
};
SceneCrowding crowdingOf(const Scene& scene);

}  // namespace clothstream::model
