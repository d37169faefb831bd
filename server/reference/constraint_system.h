// SPDX-License-Identifier: MIT
// Implicit constraint enforcement in double precision, with the matrix written out: [Va21] Eq. 3-17.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

namespace clothstream::reference {

// A constraint between two nodes: the substep has to bring them nearer by `excess`, m.
struct Constraint {
  std::uint32_t a = 0, b = 0;
  double excess = 0;
};

// The system of one substep:  (J M^-1 J^T + compliance I) lambda = b,  b = C + h J v.  C is the excess of the
// constraints, and J the derivative of |x_b - x_a| at the substep's start. Then x -= M^-1 J^T lambda. In this
// form (lambda is the paper's times h^2) lambda is a mass times a length over a length: kg m / m.
class ConstraintSystem {
 public:
  // `start` are the positions for J; `velocities` are those of the free motion that the forces alone give.
  // `compliance` is in 1/kg, already divided by h^2. Constraints between nodes without inverse mass are left
  // out.
  ConstraintSystem(std::span<const Constraint> constraints, std::span<const Eigen::Vector3d> start,
                   std::span<const Eigen::Vector3d> velocities, std::span<const double> inverseMasses,
                   double compliance, double h);

  Eigen::Index count() const { return side_.size(); }
  // J M^-1 J^T + compliance I.
  Eigen::SparseMatrix<double> matrix() const;
  const Eigen::VectorXd& side() const { return side_; }

  struct Solution {
    Eigen::VectorXd multipliers;
    std::uint32_t iterations = 0;
    double residual = 0;  // norm, relative to its start
  };
  // Starts from zero. Ends when the residual's norm is `tolerance` times that at the start, or after
  // `iterations`.
  Solution conjugateGradients(std::uint32_t iterations, double tolerance) const;

  // -M^-1 J^T lambda: displacement of each node.
  std::vector<Eigen::Vector3d> moves(const Eigen::VectorXd& multipliers) const;

 private:
  Eigen::SparseMatrix<double> jacobian_;  // one row per constraint, three columns per node
  Eigen::VectorXd inverseMasses_;         // three per node
  Eigen::VectorXd side_;
  double compliance_;
};

}  // namespace clothstream::reference
