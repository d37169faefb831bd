// SPDX-License-Identifier: MIT
// Coarse level of a cloth: means of its nodes, which are never farther apart than at rest. Springs carry a
// pull by one node in a substep; the coarse level carries it across the cloth. The idea of one-sided coarse
// constraints: Mueller, "Hierarchical Position Based Dynamics", VRIPHYS 2008. Means and interpolation are
// those of a Galerkin two-level method.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

// Minimum damping of structural springs, as a fraction of the mean mass of a node per step. With less,
// corrections and contacts with a fast collider feed on each other. Found by experiment (clothstream-bench
// coarse).
inline constexpr float kCoarseDamping = 0.05f;
// Maximum number of coarse nodes of a cloth.
inline constexpr std::uint32_t kMaxCoarseNodes = 17 * 17;

struct CoarseLevel {
  struct Share {
    std::uint32_t node = 0;
    float weight = 0;
  };
  // Two coarse nodes and their largest distance, m. The first one takes `partOfA` of a correction and the
  // second one the rest, as their masses demand: momentum and angular momentum of a free cloth stay the same.
  struct Link {
    std::uint32_t a = 0, b = 0;
    float longest = 0, partOfA = 0.5f;
  };

  // Grids: coarse rows and columns, and rows or columns between them. The coarse node (r, c) has the number
  // r * columns + c, and lies at row min(r * stride, last row). Its mean has bilinear weights, which are 0 at
  // the neighbouring coarse rows and columns. They are also the weights with which its correction moves
  // nodes. Meshes: 0.
  struct Lattice {
    std::uint32_t rows = 0, columns = 0, stride = 0;
  };
  Lattice lattice;
  // Nodes of the cloth whose mean is a coarse node, with weights that sum to 1: their masses times their
  // shares. A fixed coarse node is one pinned node. Empty for other coarse nodes of a grid.
  std::vector<std::vector<Share>> means;
  std::vector<std::uint8_t> fixed;  // one byte per coarse node: 1 if it does not move
  // Meshes: coarse nodes whose corrections move a node, by node, with weights that sum to 1.
  std::vector<std::array<Share, 4>> shares;
  // Links in the order of their correction. Links of one colour have no common coarse node.
  std::vector<std::vector<Link>> colours;
};

// Levels of a cloth that has `coarse`, in the order in which they act.
std::vector<CoarseLevel> coarseLevels(const Cloth& cloth);

// Minimum damping of the structural springs of a cloth that has `coarse`, N s/m, with a step of h seconds.
float leastCoarseDamping(const Cloth& cloth, double h);

}  // namespace clothstream::model
