// SPDX-License-Identifier: MIT
// One level of the coarse correction of a cloth in double precision, with means and interpolation as
// matrices: model/coarse_level.h.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/coarse_level.h"
#include "server/model/scene.h"

namespace clothstream::reference {

class CoarseCorrection {
 public:
  // `level` is one of the cloth's coarseLevels().
  CoarseCorrection(const model::Cloth& cloth, const model::CoarseLevel& level);

  // Way of each node, m. Pinned nodes have one too, which they do not take.
  std::vector<Eigen::Vector3d> ways(std::span<const Eigen::Vector3d> positions) const;

 private:
  struct Link {
    Eigen::Index a, b;
    double longest;  // m
  };

  Eigen::SparseMatrix<double, Eigen::RowMajor> means_;          // coarse nodes from nodes
  Eigen::SparseMatrix<double, Eigen::RowMajor> interpolation_;  // nodes from coarse nodes
  Eigen::VectorXd masses_;  // of coarse nodes, relative; infinite if fixed
  std::vector<Link> links_;
  std::uint32_t sweeps_;
};

}  // namespace clothstream::reference
