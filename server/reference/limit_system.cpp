// SPDX-License-Identifier: MIT
// A round of ACAD's one-sided limit in double precision, with the matrix written out.
#include "server/reference/limit_system.h"

#include <Eigen/SparseCore>
#include <cmath>
#include <vector>

namespace clothstream::reference {

bool limitRound(std::span<const LimitedSpring> springs, std::span<const Eigen::Vector3d> free,
                std::span<const double> inverseMasses, double compliance, std::uint32_t iterations,
                double tolerance, std::span<Eigen::Vector3d> positions) {
  const auto at = [](std::size_t node) { return static_cast<Eigen::Index>(3 * node); };
  const Eigen::Index size = at(positions.size());
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(size), weight = Eigen::VectorXd::Zero(size);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (inverseMasses[i] == 0) continue;
    weight.segment<3>(at(i)).setConstant(inverseMasses[i]);
    residual.segment<3>(at(i)) = compliance / inverseMasses[i] * (free[i] - positions[i]);
  }
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Index rows = 0;
  for (const LimitedSpring& spring : springs) {
    const Eigen::Vector3d d = positions[spring.b] - positions[spring.a];
    const double excess = d.norm() - spring.longest;
    if (excess <= 0 || inverseMasses[spring.a] + inverseMasses[spring.b] == 0) continue;
    const Eigen::Vector3d direction = d.normalized();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      entries.emplace_back(rows, at(spring.a) + axis, -direction[axis]);
      entries.emplace_back(rows, at(spring.b) + axis, direction[axis]);
    }
    ++rows;
    residual.segment<3>(at(spring.a)) += excess * direction;
    residual.segment<3>(at(spring.b)) -= excess * direction;
  }
  for (Eigen::Index i = 0; i < size; ++i)
    if (weight[i] == 0) residual[i] = 0;
  if (residual.isZero(0)) return false;
  Eigen::SparseMatrix<double> jacobian(rows, size);
  jacobian.setFromTriplets(entries.begin(), entries.end());

  // Conjugate gradients with the inverse masses as preconditioner. Only free nodes have unknowns.
  const auto multiply = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    Eigen::VectorXd product = jacobian.transpose() * (jacobian * v);
    for (Eigen::Index i = 0; i < size; ++i)
      product[i] = weight[i] == 0 ? 0 : product[i] + compliance / weight[i] * v[i];
    return product;
  };
  Eigen::VectorXd change = Eigen::VectorXd::Zero(size), z = weight.cwiseProduct(residual), direction = z;
  double square = residual.dot(z);
  const double start = square;
  for (std::uint32_t i = 0; i < iterations && square > start * tolerance * tolerance && square > 0; ++i) {
    const Eigen::VectorXd image = multiply(direction);
    const double step = square / direction.dot(image);
    change += step * direction;
    residual -= step * image;
    z = weight.cwiseProduct(residual);
    const double next = residual.dot(z);
    direction = z + next / square * direction;
    square = next;
  }
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] += change.segment<3>(at(i));
  return true;
}

}  // namespace clothstream::reference
