// SPDX-License-Identifier: MIT
// A step of ACAD written from the paper alone: [Va21] 2.1, 2.2, 3.3 and Fig. 5, with dense matrices in double
// precision. It shares no code with the kernels or with server/reference.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace clothstream::tests {

// A spring of [Va21] Eq. 1 between two nodes. SI units.
struct PaperSpring {
  std::size_t one = 0, two = 0;
  double restLength = 0, stiffness = 0, damping = 0;
  bool mayConstrain = true;  // false: the spring is a force at every length
};

struct PaperSystem {
  std::vector<PaperSpring> springs;
  Eigen::VectorXd masses;   // kg, by node
  std::vector<bool> fixed;  // by node
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  double drag = 0;         // 1/s, force of -drag m v on each node
  double threshold = 0.1;  // stretch beyond which a spring becomes a constraint
};

// Positions and velocities, three numbers a node.
struct PaperState {
  Eigen::VectorXd q, velocity;
};

// Springs that are constraints in a step from this state.
std::vector<std::size_t> paperConstraints(const PaperSystem& system, const PaperState& state);

// One step of `dt` seconds. Eq. 11 is solved with a dense orthogonal decomposition, which gives the shortest
// vector of multipliers where the system is singular.
PaperState paperStep(const PaperSystem& system, const PaperState& state, double dt);

// Springs of a grid of nodes, row by row: structural, shear and bend springs as in Fig. 1, with rest lengths
// of a flat sheet.
struct PaperGrid {
  std::size_t rows = 0, columns = 0;
  double rowSpacing = 0, columnSpacing = 0;  // m
  PaperSpring structural, shear, bend;       // stiffness, damping and mayConstrain of each kind
};
std::vector<PaperSpring> paperSprings(const PaperGrid& grid);

}  // namespace clothstream::tests
