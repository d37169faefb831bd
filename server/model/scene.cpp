// SPDX-License-Identifier: MIT
// Numbers of the environment. Rest positions, masses and pins, computed from the numbers of a scene.
#include "server/model/scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

#include "proto/codec/reach.h"
#include "server/model/cloth_skin.h"
#include "server/model/mesh.h"

namespace clothstream::model {
namespace {

// Mean distance between neighbours in a row or column of a grid; mean edge of a mesh's triangles. Metres.
double meanEdge(const Cloth& cloth) {
  if (!cloth.mesh) {
    const GridSpacing s = spacing(cloth.grid);
    return 0.5 * (double{s.column} + double{s.row});
  }
  const MeshShape& shape = cloth.mesh->shape;
  double sum = 0;
  for (const Triangle& t : shape.triangles) {
    for (std::size_t i = 0; i < 3; ++i)
      sum += double{(shape.positions[t[i]] - shape.positions[t[(i + 1) % 3]]).norm()};
  }
  return sum / (3 * static_cast<double>(shape.triangles.size()));
}

}  // namespace

std::uint32_t Scene::nodeCount() const {
  std::uint32_t sum = 0;
  for (const Cloth& cloth : cloths) sum += cloth.nodeCount();
  return sum;
}

float correctionFraction(const Solver& solver) {
  return solver.correctionFraction.value_or(1.0f);
}

bool isAcad(const Solver& solver, AcadMode mode) {
  return solver.kind == SolverKind::acad && solver.acadMode == mode;
}

std::uint32_t iterationsOf(const Solver& solver) {
  if (!isAcad(solver, AcadMode::limit)) return solver.iterations;
  return (solver.iterations + kLimitRounds - 1) / kLimitRounds;
}

bool isAssembled(const Solver& solver) {
  return solver.kind == SolverKind::constraint && solver.path == ConstraintPath::assembled;
}

std::uint32_t Cloth::nodeCount() const {
  return mesh ? mesh->nodeCount() : grid.nodeCount();
}

float& numberOf(Environment& environment, parameters::EnvironmentField field, std::uint32_t number) {
  switch (field) {
    case parameters::kGravity:
      return environment.gravity[number];
    case parameters::kWind:
      return environment.wind[number];
    case parameters::kAirDensity:
      return environment.airDensity;
    case parameters::kGust:
      break;
  }
  return number == 0 ? environment.gust.strength : environment.gust.seconds;
}

double areaOf(const Cloth& cloth) {
  return cloth.mesh ? cloth.mesh->area : double{cloth.grid.width} * double{cloth.grid.height};
}

std::vector<Vec3> restPositions(const Grid& grid) {
  const Eigen::Vector3d origin = grid.pose.position.cast<double>();
  const Eigen::Matrix3d rotation = grid.pose.orientation.cast<double>().toRotationMatrix();
  std::vector<Vec3> positions;
  positions.reserve(grid.nodeCount());
  for (std::uint32_t row = 0; row < grid.rows; ++row) {
    const double y = -double{grid.height} * row / (grid.rows - 1);
    for (std::uint32_t column = 0; column < grid.columns; ++column) {
      const double x = double{grid.width} * column / (grid.columns - 1) - 0.5 * double{grid.width};
      positions.push_back((origin + rotation * Eigen::Vector3d(x, y, 0)).cast<float>());
    }
  }
  return positions;
}

std::vector<Vec3> restPositions(const Cloth& cloth) {
  return cloth.mesh ? cloth.mesh->shape.positions : restPositions(cloth.grid);
}

std::vector<double> nodeMasses(const Cloth& cloth) {
  if (!cloth.mesh) return std::vector<double>(cloth.nodeCount(), double{cloth.mass} / cloth.nodeCount());
  std::vector<double> masses;
  masses.reserve(cloth.nodeCount());
  for (const double share : cloth.mesh->shares) masses.push_back(share * cloth.mass);
  return masses;
}

namespace {

void choose(const Cloth& cloth, const std::vector<GridRange>& ranges,
            const std::vector<std::uint32_t>& vertices, const std::vector<Region>& regions,
            std::vector<std::uint8_t>& chosen) {
  for (const std::uint32_t node : vertices) chosen[node] = 1;
  if (!regions.empty()) {
    const std::vector<Vec3> rest = restPositions(cloth);
    for (const Region& region : regions)
      for (std::size_t i = 0; i < rest.size(); ++i)
        if (region.contains(rest[i])) chosen[i] = 1;
  }
  for (const GridRange& range : ranges) {
    assert(range.rowStep > 0 && range.columnStep > 0);
    assert(range.lastRow < cloth.grid.rows && range.lastColumn < cloth.grid.columns);
    for (std::uint32_t row = range.firstRow; row <= range.lastRow; row += range.rowStep)
      for (std::uint32_t column = range.firstColumn; column <= range.lastColumn; column += range.columnStep)
        chosen[row * cloth.grid.columns + column] = 1;
  }
}

}  // namespace

bool Region::contains(const Vec3& point) const {
  const Eigen::Vector3d away = (point.cast<double>() - centre.cast<double>()).cwiseAbs();
  if (radius) return away.squaredNorm() <= double{*radius} * double{*radius};
  return (2 * away.array() <= size.cast<double>().array()).all();
}

std::vector<std::uint8_t> pinnedNodes(const Cloth& cloth) {
  std::vector<std::uint8_t> pinned(cloth.nodeCount(), 0);
  choose(cloth, cloth.pins, cloth.pinnedVertices, cloth.pinnedRegions, pinned);
  for (const Attachment& attachment : cloth.attachments)
    choose(cloth, attachment.ranges, attachment.vertices, attachment.regions, pinned);
  if (cloth.skin)
    for (std::size_t i = 0; i < pinned.size(); ++i)
      if (cloth.skin->limits[i].followsExactly()) pinned[i] = 1;
  return pinned;
}

std::vector<std::uint8_t> attachedNodes(const Cloth& cloth, const Attachment& attachment) {
  std::vector<std::uint8_t> attached(cloth.nodeCount(), 0);
  choose(cloth, attachment.ranges, attachment.vertices, attachment.regions, attached);
  return attached;
}

Pose frameAt(const Scene& scene, const Attachment& attachment, double seconds) {
  if (attachment.collider.empty()) return poseAt(attachment.pose, attachment.motion, seconds);
  const auto collider = std::ranges::find(scene.colliders, attachment.collider, &Collider::name);
  assert(collider != scene.colliders.end());
  return poseAt(collider->pose, collider->motion, seconds);
}

GridSpacing spacing(const Grid& grid) {
  const double column = double{grid.width} / (grid.columns - 1);
  const double row = double{grid.height} / (grid.rows - 1);
  return {static_cast<float>(column), static_cast<float>(row),
          static_cast<float>(std::sqrt(column * column + row * row))};
}

float suitedMaxError(const Scene& scene) {
  constexpr double kPartOfEdge = 1.0 / 40, kFinest = 0.00005, kCoarsest = 0.0005;
  double error = kCoarsest;
  for (const Cloth& cloth : scene.cloths) error = std::min(error, kPartOfEdge * meanEdge(cloth));
  return static_cast<float>(std::max(error, kFinest));
}

float reachOf(const StreamSettings& stream) {
  return codec::reachOf(stream.maxError, stream.qualities);
}

float maxErrorFor(float distance) {
  return codec::maxErrorFor(distance);
}

}  // namespace clothstream::model
