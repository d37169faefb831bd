// SPDX-License-Identifier: MIT
#include "server/model/origin.h"

#include <limits>

#include "server/model/mesh.h"

namespace clothstream::model {

Vec3 originOf(const Scene& scene) {
  Vec3 low = Vec3::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const Cloth& cloth : scene.cloths)
    for (const Vec3& position : restPositions(cloth)) {
      low = low.cwiseMin(position);
      high = high.cwiseMax(position);
    }
  if (scene.cloths.empty()) return Vec3::Zero();
  return kOriginStep * ((low / 2 + high / 2) / kOriginStep).array().round().matrix();
}

std::vector<Vec3> restPositions(const Cloth& cloth, const Vec3& origin) {
  if (!cloth.mesh) {
    Grid grid = cloth.grid;
    grid.pose.position -= origin;
    return restPositions(grid);
  }
  std::vector<Vec3> positions = restPositions(cloth);
  for (Vec3& position : positions) position -= origin;
  return positions;
}

}  // namespace clothstream::model
