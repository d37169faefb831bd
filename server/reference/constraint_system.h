// SPDX-License-Identifier: MIT
// Implicit constraint enforcement in double precision, with the matrix written out: [Va21] Eq. 3-17.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

namespace clothstream::reference {

// Between two nodes, which a substep is to bring nearer to each other by `excess`, m, than they are at its
// start.
struct Constraint {
  std::uint32_t a = 0, b = 0;
  double excess = 0;
};

// One substep's system  (J M^-1 J^T + compliance I) lambda = b,  b = C + h J v,  with C the constraints'
// excess and J the derivative of |x_b - x_a| at the substep's start; then x -= M^-1 J^T lambda. In this form
// (lambda times h^2 of the paper's) lambda is a mass times a length over a length: kg m / m.
class ConstraintSystem {
 public:
  // `start`: positions that J is of; `velocities`: those that the forces alone give. `compliance` in 1/kg,
  // scaled by 1 / h^2 already. Constraints between nodes without inverse mass are left out.
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
    double residual = 0;  // norm, relative to where it started
  };
  // From zero, until the residual's norm is `tolerance` of where it started, or the iterations are spent.
  Solution conjugateGradients(std::uint32_t iterations, double tolerance) const;

  // -M^-1 J^T lambda: how far each node goes.
  std::vector<Eigen::Vector3d> moves(const Eigen::VectorXd& multipliers) const;

 private:
  Eigen::SparseMatrix<double> jacobian_;  // a row a constraint, three columns a node
  Eigen::VectorXd inverseMasses_;         // three a node
  Eigen::VectorXd side_;
  double compliance_;
};

}  // namespace clothstream::reference
