// SPDX-License-Identifier: MIT
#include "server/model/origin.h"

#include "server/model/cloth_skin.h"
#include "server/model/mesh.h"

namespace clothstream::model {
namespace {

struct Extent {
  Vec3 low, high;
};

// Box of the rest positions of a cloth.
Extent extentOf(const Cloth& cloth) {
  if (cloth.mesh) return {cloth.mesh->low, cloth.mesh->high};
  Grid corners = cloth.grid;
  corners.rows = corners.columns = 2;
  const std::vector<Vec3> positions = restPositions(corners);
  Extent extent{positions[0], positions[0]};
  for (const Vec3& position : positions) {
    extent.low = extent.low.cwiseMin(position);
    extent.high = extent.high.cwiseMax(position);
  }
  return extent;
}

// Box of the start positions of a cloth.
Extent startExtentOf(const Cloth& cloth) {
  return cloth.skin ? Extent{cloth.skin->low, cloth.skin->high} : extentOf(cloth);
}

Vec3 originOf(const Extent& extent) {
  const Vec3 steps = ((extent.low / 2 + extent.high / 2) / kOriginStep).array().round();
  return kOriginStep * steps + Vec3::Zero();  // without -0
}

}  // namespace

Vec3 originOf(const Scene& scene) {
  if (scene.cloths.empty()) return Vec3::Zero();
  Extent all = startExtentOf(scene.cloths[0]);
  for (const Cloth& cloth : scene.cloths) {
    const Extent extent = startExtentOf(cloth);
    all.low = all.low.cwiseMin(extent.low);
    all.high = all.high.cwiseMax(extent.high);
  }
  return originOf(all);
}

Vec3 originOf(const Cloth& cloth) {
  return originOf(extentOf(cloth));
}

float farthestFrom(const Vec3& point, const Cloth& cloth) {
  const Extent extent = startExtentOf(cloth);
  return (extent.high - point).cwiseMax(point - extent.low).maxCoeff();
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
