// SPDX-License-Identifier: MIT
// Implicit constraint enforcement in double precision.
#include "server/reference/constraint_system.h"

#include <cmath>

namespace clothstream::reference {
namespace {

Eigen::Index index(std::size_t i) {
  return static_cast<Eigen::Index>(i);
}

}  // namespace

ConstraintSystem::ConstraintSystem(std::span<const Constraint> constraints,
                                   std::span<const Eigen::Vector3d> start,
                                   std::span<const Eigen::Vector3d> velocities,
                                   std::span<const double> inverseMasses, double compliance, double h)
    : inverseMasses_(index(3 * inverseMasses.size())), compliance_(compliance) {
  for (std::size_t i = 0; i < inverseMasses.size(); ++i)
    inverseMasses_.segment<3>(index(3 * i)).setConstant(inverseMasses[i]);
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<double> side;
  for (const Constraint& link : constraints) {
    if (inverseMasses[link.a] == 0 && inverseMasses[link.b] == 0) continue;
    const Eigen::Vector3d d = start[link.b] - start[link.a];
    const Eigen::Vector3d direction = d.normalized();
    const Eigen::Index row = index(side.size());
    for (int axis = 0; axis < 3; ++axis) {
      entries.emplace_back(row, index(3 * link.a) + axis, -direction[axis]);
      entries.emplace_back(row, index(3 * link.b) + axis, direction[axis]);
    }
    side.push_back(link.excess + h * direction.dot(velocities[link.b] - velocities[link.a]));
  }
  side_ = Eigen::Map<const Eigen::VectorXd>(side.data(), index(side.size()));
  jacobian_.resize(side_.size(), inverseMasses_.size());
  jacobian_.setFromTriplets(entries.begin(), entries.end());
}

Eigen::SparseMatrix<double> ConstraintSystem::matrix() const {
  Eigen::SparseMatrix<double> identity(count(), count());
  identity.setIdentity();
  const Eigen::SparseMatrix<double> weighted = jacobian_ * inverseMasses_.asDiagonal();
  const Eigen::SparseMatrix<double> transposed = jacobian_.transpose();
  const Eigen::SparseMatrix<double> product = weighted * transposed;
  return product + compliance_ * identity;
}

ConstraintSystem::Solution ConstraintSystem::conjugateGradients(std::uint32_t iterations,
                                                                double tolerance) const {
  const Eigen::SparseMatrix<double> A = matrix();
  Solution solution{.multipliers = Eigen::VectorXd::Zero(count()), .iterations = 0, .residual = 0};
  Eigen::VectorXd residual = side_, direction = side_;
  const double start = residual.squaredNorm();
  double square = start;
  while (solution.iterations < iterations && square > start * tolerance * tolerance) {
    const Eigen::VectorXd product = A * direction;
    const double length = square / direction.dot(product);
    solution.multipliers += length * direction;
    residual -= length * product;
    const double before = square;
    square = residual.squaredNorm();
    direction = residual + square / before * direction;
    ++solution.iterations;
  }
  if (start > 0) solution.residual = std::sqrt(square / start);
  return solution;
}

std::vector<Eigen::Vector3d> ConstraintSystem::moves(const Eigen::VectorXd& multipliers) const {
  const Eigen::VectorXd all = -inverseMasses_.cwiseProduct(jacobian_.transpose() * multipliers);
  std::vector<Eigen::Vector3d> moves;
  for (Eigen::Index i = 0; i < all.size(); i += 3) moves.push_back(all.segment<3>(i));
  return moves;
}

}  // namespace clothstream::reference
