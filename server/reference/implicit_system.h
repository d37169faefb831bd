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

// Between two nodes; N/m, N s/m, m.
struct ImplicitSpring {
  std::uint32_t a = 0, b = 0;
  double stiffness = 0, damping = 0, restLength = 0;
};

// One substep's system  (M + h D + h^2 K) u = -(h D (v_free - v) + h^2 K v_free)  for the velocities v_free +
// u, with D and K the springs' derivatives at the substep's start, of K what pushes across a compressed
// spring left out. Nodes without inverse mass have u = 0.
class ImplicitSystem {
 public:
  // `free`: the velocities that the forces alone give from `velocities`.
  ImplicitSystem(std::span<const ImplicitSpring> springs, std::span<const Eigen::Vector3d> positions,
                 std::span<const Eigen::Vector3d> velocities, std::span<const Eigen::Vector3d> free,
                 std::span<const double> inverseMasses, double h);

  // kg, three rows a node; of pinned nodes those of the identity.
  const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }
  const Eigen::VectorXd& side() const { return side_; }

  // u, m/s a node, by a factorisation.
  std::vector<Eigen::Vector3d> solve() const;

 private:
  Eigen::SparseMatrix<double> matrix_;
  Eigen::VectorXd side_;
};

}  // namespace clothstream::reference
