// SPDX-License-Identifier: MIT
// A sheet of springs in double precision, solved by Newton's method. It is written apart from server/model
// and server/reference, to test both.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace clothstream::tests {

// rows x columns nodes of equal mass with the springs of [Va21] Fig. 1. Springs of an equal kind have an
// equal stiffness and no damping.
class NewtonSheet {
 public:
  using Vec3 = Eigen::Vector3d;

  struct Settings {
    std::size_t rows = 2, columns = 2;
    double structural = 0, shear = 0, bend = 0;  // N/m
    double nodeMass = 0;                         // kg
    Vec3 gravity = Vec3::Zero();                 // m/s^2
  };

  // `rest` are the places at rest, row by row; `pinned` has one entry a node.
  NewtonSheet(const Settings& settings, const std::vector<Vec3>& rest, std::vector<bool> pinned);

  // Places at which the forces on every free node balance to 1e-9 of its weight. Starts the search at
  // `start`.
  std::vector<Vec3> balance(std::vector<Vec3> start) const;

  // One step of implicit Euler: v' = v + h a(x + h v') - h c v with the damping rate c, x' = x + h v'.
  // Newton's method solves it to 1e-9 of the weight.
  void step(std::vector<Vec3>& positions, std::vector<Vec3>& velocities, double damping, double h) const;

 private:
  struct Spring {
    std::size_t a, b;
    double stiffness, length;
  };
  struct Anchor {
    std::vector<Vec3> places;
    double stiffness;  // N/m, from each node to its place
  };

  double energy(const std::vector<Vec3>& x, const Anchor& anchor) const;
  // Takes a step of Newton's method, shortened until the energy falls. Returns the norm of the forces before.
  double improve(std::vector<Vec3>& x, const Anchor& anchor) const;
  double enough() const;  // N

  Settings settings_;
  std::vector<bool> pinned_;
  std::vector<Spring> springs_;
};

}  // namespace clothstream::tests
