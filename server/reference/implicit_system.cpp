// SPDX-License-Identifier: MIT
// Linearised implicit Euler in double precision.
#include "server/reference/implicit_system.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

namespace clothstream::reference {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A spring that is longer than kOverlong rest lengths has an additional dashpot: its stiffness times this
// time, in seconds, for each further rest length.
constexpr double kOverlong = 1.1, kCalmSeconds = 0.1;

Eigen::Index row(std::uint32_t node) {
  return 3 * static_cast<Eigen::Index>(node);
}

}  // namespace

ImplicitSystem::ImplicitSystem(std::span<const ImplicitSpring> springs, std::span<const Vector3d> positions,
                               std::span<const Vector3d> velocities, std::span<const Vector3d> free,
                               std::span<const double> inverseMasses, double h) {
  const auto nodes = static_cast<std::uint32_t>(positions.size());
  const auto moves = [&](std::uint32_t node) { return inverseMasses[node] > 0; };
  side_ = Eigen::VectorXd::Zero(row(nodes));
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](std::uint32_t i, std::uint32_t j, const Matrix3d& block) {
    if (!moves(i) || !moves(j)) return;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) entries.emplace_back(row(i) + r, row(j) + c, block(r, c));
  };
  for (std::uint32_t node = 0; node < nodes; ++node)
    for (int axis = 0; axis < 3; ++axis)
      entries.emplace_back(row(node) + axis, row(node) + axis, moves(node) ? 1 / inverseMasses[node] : 1);
  for (const ImplicitSpring& spring : springs) {
    const Vector3d d = positions[spring.b] - positions[spring.a];
    const double length = d.norm();
    const Matrix3d along = d * d.transpose() / (length * length);
    const double tension = std::max(0.0, 1 - spring.restLength / length);
    const Matrix3d elastic = h * h * spring.stiffness * (along + tension * (Matrix3d::Identity() - along));
    const Matrix3d viscous = h * spring.damping * along;
    const double overlong = std::max(0.0, length / spring.restLength - kOverlong);
    const Matrix3d calming = h * kCalmSeconds * spring.stiffness * overlong * along;
    const Matrix3d block = elastic + viscous + calming;
    add(spring.a, spring.a, block);
    add(spring.b, spring.b, block);
    add(spring.a, spring.b, -block);
    add(spring.b, spring.a, -block);
    const Vector3d change = velocities[spring.b] - velocities[spring.a];
    const Vector3d freeChange = free[spring.b] - free[spring.a];
    const Vector3d impulse = block * freeChange - viscous * change;
    if (moves(spring.a)) side_.segment<3>(row(spring.a)) += impulse;
    if (moves(spring.b)) side_.segment<3>(row(spring.b)) -= impulse;
  }
  matrix_.resize(side_.size(), side_.size());
  matrix_.setFromTriplets(entries.begin(), entries.end());
}

std::vector<Vector3d> ImplicitSystem::solve() const {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix_);
  const Eigen::VectorXd all = factors.solve(side_);
  std::vector<Vector3d> velocities;
  for (Eigen::Index i = 0; i < all.size(); i += 3) velocities.push_back(all.segment<3>(i));
  return velocities;
}

}  // namespace clothstream::reference
