// SPDX-License-Identifier: MIT
// Gas inside a closed cloth.
#include "server/model/gas.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace clothstream::model {

bool canHoldGas(const Cloth& cloth) {
  return cloth.mesh && !cloth.mesh->openEdge && cloth.mesh->pieces == 1 &&
         cloth.mesh->volume >= kMinGasVolume;
}

std::optional<std::string> unfitForGas(const Cloth& cloth) {
  if (canHoldGas(cloth)) return std::nullopt;
  if (!cloth.mesh) return "is a grid, which is open; only a closed mesh holds gas";
  const Mesh& mesh = *cloth.mesh;
  if (mesh.openEdge) {
    const auto at = [&](std::size_t i) {
      const Vec3& place = mesh.shape.positions[(*mesh.openEdge)[i]];
      return fmt::format("({:.4g} {:.4g} {:.4g})", place.x(), place.y(), place.z());
    };
    return fmt::format(
        "is open, among others at the edge from {} to {} m; close the surface, or weld its seams with "
        "mesh.weldDistance",
        at(0), at(1));
  }
  if (mesh.pieces > 1)
    return fmt::format("has {} separate pieces; gas needs a mesh of one piece: make each a cloth",
                       mesh.pieces);
  if (mesh.volume <= -kMinGasVolume)
    return "is inside out; turn all its faces, which must be counter-clockwise from outside, or set "
           "mesh.repair";
  return fmt::format("encloses {:.3g} m^3 at rest; gas needs at least {:.3g} m^3", mesh.volume,
                     kMinGasVolume);
}

double enclosedVolume(std::span<const Triangle> triangles, std::span<const Eigen::Vector3d> positions) {
  double sum = 0;
  for (const Triangle& triangle : triangles) {
    const auto at = [&](std::size_t i) { return (positions[triangle[i]] - positions[0]).eval(); };
    sum += at(0).dot(at(1).cross(at(2)));
  }
  return sum / 6;
}

std::vector<Eigen::Vector3d> volumeGradients(std::span<const Triangle> triangles,
                                             std::span<const Eigen::Vector3d> positions) {
  std::vector<Eigen::Vector3d> gradients(positions.size(), Eigen::Vector3d::Zero());
  for (const Triangle& triangle : triangles) {
    const auto& [a, b, c] = triangle;
    const Eigen::Vector3d share = (positions[b] - positions[a]).cross(positions[c] - positions[a]) / 6;
    for (const std::uint32_t node : triangle) gradients[node] += share;
  }
  return gradients;
}

// response r^2 + (volume + response) r + volume - 1 - atRest = 0. The form with the sum below has no
// cancellation while the volume is positive.
double gasPressure(double atRest, double volume, double response) {
  const double excess = atRest + (1 - volume), sum = volume + response, difference = volume - response;
  const double root = std::sqrt(difference * difference + 4 * response * (1 + atRest));
  return sum > 0 ? 2 * excess / (sum + root) : (root - sum) / (2 * response);
}

double boundedPressure(double pressure, double start, double volume, double response) {
  constexpr double kTinyResponse = 1e-18;  // of a cloth that is pinned as a whole
  if (response < kTinyResponse) return pressure;
  const double most = kMostVolumeChange * std::max(std::abs(start), kSmallVolume);
  const double end = volume + response * pressure;
  if (end > start + most) return (start + most - volume) / response;
  if (end < start - most) return (start - most - volume) / response;
  return pressure;
}

}  // namespace clothstream::model
