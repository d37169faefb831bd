// SPDX-License-Identifier: MIT
// Collects the hinges of a cloth and computes their angles.
#include "server/model/hinges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "server/model/mesh.h"
#include "server/model/origin.h"

namespace clothstream::model {
namespace {

using Eigen::Vector3d;

// Minimum height of a compressed triangle, as a fraction of its height at rest.
constexpr double kLeastPart = 0.25;
// Minimum of (2 cos(delta / 2))^2. Opposite to the rest angle, both ways back are as short.
constexpr double kOpposite = 1e-6;

// Weight of a quad's diagonals relative to an edge of a triangle mesh. It makes alternately twisted quads
// resist.
constexpr float kDiagonalPart = 0.125f;

// Corners of a triangle or of a quad, counter-clockwise.
using Face = std::vector<std::uint32_t>;

// Corners of a face next to its edge from a to b.
struct FaceSide {
  std::uint32_t beforeStart, afterEnd;
};

Face quadOf(const Triangle& first, const Triangle& second) {
  const auto isIn = [](const Triangle& triangle, std::uint32_t node) {
    return std::ranges::find(triangle, node) != triangle.end();
  };
  const auto apex = std::ranges::find_if(first, [&](std::uint32_t node) { return !isIn(second, node); });
  const auto opposite = std::ranges::find_if(second, [&](std::uint32_t node) { return !isIn(first, node); });
  const auto i = static_cast<std::size_t>(apex - first.begin());
  return {*apex, first[(i + 1) % 3], *opposite, first[(i + 2) % 3]};
}

std::vector<Face> facesOf(const Cloth& cloth) {
  const std::vector<Triangle> triangles = clothTriangles(cloth);
  std::vector<std::uint8_t> startsQuad(triangles.size(), 0);
  if (cloth.mesh)
    for (const std::uint32_t t : cloth.mesh->shape.quads) startsQuad[t] = 1;
  else
    for (std::size_t t = 0; t < triangles.size(); t += 2) startsQuad[t] = 1;
  std::vector<Face> faces;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (startsQuad[t] != 0) {
      faces.push_back(quadOf(triangles[t], triangles[t + 1]));
      ++t;
    } else {
      faces.emplace_back(triangles[t].begin(), triangles[t].end());
    }
  return faces;
}

std::array<Vector3d, 4> cornersOf(const std::vector<Vec3>& rest, const std::array<std::uint32_t, 4>& nodes) {
  std::array<Vector3d, 4> corners;
  for (std::size_t i = 0; i < nodes.size(); ++i) corners[i] = rest[nodes[i]].cast<double>();
  return corners;
}

Hinge hingeOf(const std::vector<Vec3>& rest, const std::array<std::uint32_t, 4>& nodes) {
  const auto [a, b, c, d] = cornersOf(rest, nodes);
  const double first = (a - c).cross(b - c).squaredNorm(), second = (b - d).cross(a - d).squaredNorm();
  const double area = (std::sqrt(first) + std::sqrt(second)) / 2;
  const double least = kLeastPart * std::min(first, second);
  const HingeShape shape = hingeShape({a, b, c, d}, least);
  return {nodes, static_cast<float>((b - a).squaredNorm() / area),
          static_cast<float>(std::atan2(shape.sine, shape.cosine)), static_cast<float>(least)};
}

}  // namespace

HingeShape hingeShape(const std::array<Vector3d, 4>& positions, double leastSquare) {
  const auto& [a, b, c, d] = positions;
  const Vector3d edge = b - a;
  const double length = std::sqrt(std::max(edge.squaredNorm(), 1e-12));
  const Vector3d along = edge / length;
  const Vector3d first = (a - c).cross(b - c), second = (b - d).cross(a - d);
  const Vector3d n1 = first / std::sqrt(std::max(first.squaredNorm(), leastSquare));
  const Vector3d n2 = second / std::sqrt(std::max(second.squaredNorm(), leastSquare));
  // Normals divided by the heights of c and d above the edge.
  const Vector3d h1 = first / std::max(first.squaredNorm(), leastSquare);
  const Vector3d h2 = second / std::max(second.squaredNorm(), leastSquare);
  return {n2.cross(n1).dot(along),
          n1.dot(n2),
          {-(b - c).dot(along) * h1 - (b - d).dot(along) * h2,
           (a - c).dot(along) * h1 + (a - d).dot(along) * h2, length * h1, length * h2}};
}

double bentFromRest(const HingeShape& shape, double restAngle) {
  const double restSine = std::sin(restAngle), restCosine = std::cos(restAngle);
  const double sine = shape.sine * restCosine - shape.cosine * restSine;
  const double cosine = shape.cosine * restCosine + shape.sine * restSine;
  return 2 * sine / std::sqrt(std::max(2 + 2 * cosine, kOpposite));
}

std::vector<Hinge> hinges(const Cloth& cloth) {
  const std::vector<Vec3> rest = restPositions(cloth, originOf(cloth));
  std::vector<Hinge> found;
  const auto add = [&](const std::array<std::uint32_t, 4>& nodes, float part) {
    found.push_back(hingeOf(rest, nodes));
    found.back().weight *= part;
  };
  std::unordered_map<std::uint64_t, FaceSide> sides;  // edges that have one face so far
  const auto edge = [](std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; };
  for (const Face& face : facesOf(cloth)) {
    if (face.size() == 4) {
      add({face[2], face[0], face[1], face[3]}, kDiagonalPart / 2);
      add({face[3], face[1], face[2], face[0]}, kDiagonalPart / 2);
    }
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = face[i], b = face[(i + 1) % face.size()];
      const FaceSide here{face[(i + face.size() - 1) % face.size()], face[(i + 2) % face.size()]};
      const auto other = sides.find(edge(b, a));
      if (other == sides.end()) {
        sides[edge(a, b)] = here;
        continue;
      }
      const FaceSide there = other->second;
      sides.erase(other);
      const bool single = here.beforeStart == here.afterEnd && there.beforeStart == there.afterEnd;
      add({a, b, here.beforeStart, there.beforeStart}, single ? 1 : 0.5f);
      if (!single) add({a, b, here.afterEnd, there.afterEnd}, 0.5f);
    }
  }
  return found;
}

// Gershgorin's circle theorem: in the sum of weight grad grad^T, the block row of a node of mass m is at most
// the sum of weight |grad_i| (sum of |grad_j|) over m.
double bendingRate(const Cloth& cloth) {
  const std::vector<Vec3> rest = restPositions(cloth, originOf(cloth));
  const std::vector<double> masses = nodeMasses(cloth);
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  std::vector<double> sums(rest.size(), 0);
  for (const Hinge& hinge : hinges(cloth)) {
    const HingeShape shape = hingeShape(cornersOf(rest, hinge.nodes), hinge.leastSquare);
    double all = 0;
    for (const Vector3d& gradient : shape.gradients) all += gradient.norm();
    for (std::size_t i = 0; i < hinge.nodes.size(); ++i)
      sums[hinge.nodes[i]] += double{hinge.weight} * shape.gradients[i].norm() * all;
  }
  double most = 0;
  for (std::size_t i = 0; i < sums.size(); ++i)
    if (pinned[i] == 0) most = std::max(most, sums[i] / masses[i]);
  return most;
}

}  // namespace clothstream::model
