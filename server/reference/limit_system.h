// SPDX-License-Identifier: MIT
// A round of ACAD's one-sided limit in double precision, with the matrix written out.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

namespace clothstream::reference {

// A spring between two nodes that must not become longer than `longest`, m.
struct LimitedSpring {
  std::uint32_t a = 0, b = 0;
  double longest = 0;
};

// One step of Newton's method for the positions x that minimise
//   compliance (x - free) M (x - free) / 2 + sum of max(0, length - longest)^2 / 2,
// from `positions`, which it replaces. `compliance` is in 1/kg, divided by h^2. Nodes without inverse mass
// stay. Conjugate gradients end after `iterations` or when the residual's norm is `tolerance` times that at
// the start. False if no spring is too long and no node was moved by an earlier round.
bool limitRound(std::span<const LimitedSpring> springs, std::span<const Eigen::Vector3d> free,
                std::span<const double> inverseMasses, double compliance, std::uint32_t iterations,
                double tolerance, std::span<Eigen::Vector3d> positions);

}  // namespace clothstream::reference
