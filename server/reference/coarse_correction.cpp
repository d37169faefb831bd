// SPDX-License-Identifier: MIT
#include "server/reference/coarse_correction.h"

#include <cstdint>
#include <limits>

#include "server/model/mesh.h"

namespace clothstream::reference {
namespace {

using Places = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Entries = std::vector<Eigen::Triplet<double>>;

Places placesOf(std::span<const Eigen::Vector3d> positions) {
  Places places(static_cast<Eigen::Index>(positions.size()), 3);
  for (std::size_t i = 0; i < positions.size(); ++i) places.row(static_cast<Eigen::Index>(i)) = positions[i];
  return places;
}

// Rows or columns with coarse nodes.
std::vector<int> coarseLines(std::uint32_t count, std::uint32_t stride) {
  std::vector<int> lines;
  for (std::uint32_t line = 0; line < count - 1; line += stride) lines.push_back(static_cast<int>(line));
  lines.push_back(static_cast<int>(count - 1));
  return lines;
}

// Share of coarse line `k` in the way of a line, linear between neighbouring coarse lines.
double share(const std::vector<int>& lines, std::size_t k, int line) {
  const auto towards = [&](int other) {
    const double part = static_cast<double>(line - lines[k]) / (other - lines[k]);
    return part >= 0 && part < 1 ? 1 - part : 0;
  };
  if (line == lines[k]) return 1;
  if (line < lines[k]) return k == 0 ? 0 : towards(lines[k - 1]);
  return k + 1 == lines.size() ? 0 : towards(lines[k + 1]);
}

// Nodes of a grid from its coarse nodes.
Entries ofGrid(const model::Grid& grid, std::uint32_t stride) {
  const std::vector<int> rows = coarseLines(grid.rows, stride), columns = coarseLines(grid.columns, stride);
  Entries entries;
  int coarse = 0;
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t c = 0; c < columns.size(); ++c, ++coarse)
      for (int row = 0; row < static_cast<int>(grid.rows); ++row)
        for (int column = 0; column < static_cast<int>(grid.columns); ++column)
          entries.emplace_back(row * static_cast<int>(grid.columns) + column, coarse,
                               share(rows, r, row) * share(columns, c, column));
  return entries;
}

Entries ofMesh(const model::CoarseLevel& level) {
  Entries entries;
  for (std::size_t node = 0; node < level.shares.size(); ++node)
    for (const auto& [coarse, weight] : level.shares[node])
      entries.emplace_back(static_cast<int>(node), static_cast<int>(coarse), double{weight});
  return entries;
}

}  // namespace

CoarseCorrection::CoarseCorrection(const model::Cloth& cloth, const model::CoarseLevel& level)
    : sweeps_(cloth.coarse->sweeps) {
  const Entries entries = cloth.mesh ? ofMesh(level) : ofGrid(cloth.grid, level.lattice.stride);
  interpolation_.resize(static_cast<Eigen::Index>(cloth.nodeCount()),
                        static_cast<Eigen::Index>(level.fixed.size()));
  interpolation_.setFromTriplets(entries.begin(), entries.end());
  interpolation_.prune(0.0);

  Eigen::VectorXd shares = Eigen::VectorXd::Ones(interpolation_.rows());
  if (cloth.mesh)
    shares = Eigen::Map<const Eigen::VectorXd>(cloth.mesh->shares.data(), interpolation_.rows());
  means_ = interpolation_.transpose() * shares.asDiagonal();
  masses_ = means_ * Eigen::VectorXd::Ones(interpolation_.rows());
  for (Eigen::Index k = 0; k < masses_.size(); ++k) {
    means_.row(k) /= masses_[k];
    if (level.fixed[static_cast<std::size_t>(k)] == 0) continue;
    means_.row(k) *= 0;
    means_.coeffRef(k, static_cast<Eigen::Index>(level.means[static_cast<std::size_t>(k)][0].node)) = 1;
    masses_[k] = std::numeric_limits<double>::infinity();
  }

  std::vector<Eigen::Vector3d> rest;
  for (const model::Vec3& place : restPositions(cloth)) rest.push_back(place.cast<double>());
  const Places restMeans = means_ * placesOf(rest);
  for (const auto& colour : level.colours)
    for (const model::CoarseLevel::Link& link : colour) {
      const Eigen::Index a = link.a, b = link.b;
      links_.push_back(
          {a, b, cloth.mesh ? double{link.longest} : (restMeans.row(b) - restMeans.row(a)).norm()});
    }
}

std::vector<Eigen::Vector3d> CoarseCorrection::ways(std::span<const Eigen::Vector3d> positions) const {
  const Places start = means_ * placesOf(positions);
  Places place = start;
  for (std::uint32_t sweep = 0; sweep < sweeps_; ++sweep)
    for (const Link& link : links_) {
      const double a = 1 / masses_[link.a], b = 1 / masses_[link.b];
      const Eigen::RowVector3d apart = place.row(link.b) - place.row(link.a);
      const double excess = apart.norm() - link.longest;
      if (excess <= 0) continue;
      place.row(link.a) += a / (a + b) * excess * apart.normalized();
      place.row(link.b) -= b / (a + b) * excess * apart.normalized();
    }
  const Places moved = interpolation_ * (place - start);
  std::vector<Eigen::Vector3d> ways(positions.size());
  for (std::size_t i = 0; i < ways.size(); ++i) ways[i] = moved.row(static_cast<Eigen::Index>(i));
  return ways;
}

}  // namespace clothstream::reference
