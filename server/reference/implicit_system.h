// SPDX-License-Identifier: MIT
// Linearised implicit Euler in double precision, with the matrix written out: Baraff and Witkin, "Large steps
// in cloth simulation", 1998, Eq. 15-16.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

namespace clothstream::reference {

// A spring between two nodes; N/m, N s/m, m.
struct ImplicitSpring {
  std::uint32_t a = 0, b = 0;
  double stiffness = 0, damping = 0, restLength = 0;
};

// The system of one substep for the velocities v_free + u:  (M + h D + h^2 K) u = -(h D (v_free - v) + h^2 K
// v_free).  D and K are the springs' derivatives at the substep's start; K leaves out the part that pushes
// across a compressed spring. The matrix also has h C and the right-hand side -h C v_free, with C the
// dashpots of springs that are far too long. Nodes without inverse mass have u = 0.
class ImplicitSystem {
 public:
  // `free` are the velocities that the forces alone give, starting from `velocities`.
  ImplicitSystem(std::span<const ImplicitSpring> springs, std::span<const Eigen::Vector3d> positions,
                 std::span<const Eigen::Vector3d> velocities, std::span<const Eigen::Vector3d> free,
                 std::span<const double> inverseMasses, double h);

  // kg, three rows per node; rows of pinned nodes are those of the identity.
  const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }
  const Eigen::VectorXd& side() const { return side_; }

  // u by node, m/s, from a factorisation.
  std::vector<Eigen::Vector3d> solve() const;

 private:
  Eigen::SparseMatrix<double> matrix_;
  Eigen::VectorXd side_;
};

}  // namespace clothstream::reference
