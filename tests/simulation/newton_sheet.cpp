// SPDX-License-Identifier: MIT
// A sheet of springs in double precision, solved by Newton's method.
#include "tests/simulation/newton_sheet.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace clothstream::tests {

NewtonSheet::NewtonSheet(const Settings& settings, const std::vector<Vec3>& rest, std::vector<bool> pinned)
    : settings_(settings), pinned_(std::move(pinned)) {
  const auto join = [&](std::size_t row, std::size_t column, std::size_t down, std::ptrdiff_t right,
                        double stiffness) {
    const auto toColumn = static_cast<std::ptrdiff_t>(column) + right;
    if (row + down >= settings.rows || toColumn < 0 ||
        toColumn >= static_cast<std::ptrdiff_t>(settings.columns))
      return;
    const std::size_t a = row * settings.columns + column;
    const std::size_t b = (row + down) * settings.columns + static_cast<std::size_t>(toColumn);
    springs_.push_back({a, b, stiffness, (rest[b] - rest[a]).norm()});
  };
  for (std::size_t row = 0; row < settings.rows; ++row)
    for (std::size_t column = 0; column < settings.columns; ++column) {
      join(row, column, 0, 1, settings.structural);
      join(row, column, 1, 0, settings.structural);
      join(row, column, 1, 1, settings.shear);
      join(row, column, 1, -1, settings.shear);
      join(row, column, 0, 2, settings.bend);
      join(row, column, 2, 0, settings.bend);
    }
}

double NewtonSheet::energy(const std::vector<Vec3>& x, const Anchor& anchor) const {
  double sum = 0;
  for (const Spring& spring : springs_) {
    const double extension = (x[spring.b] - x[spring.a]).norm() - spring.length;
    sum += spring.stiffness / 2 * extension * extension;
  }
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!pinned_[i])
      sum += anchor.stiffness / 2 * (x[i] - anchor.places[i]).squaredNorm() -
             settings_.nodeMass * settings_.gravity.dot(x[i]);
  return sum;
}

double NewtonSheet::improve(std::vector<Vec3>& x, const Anchor& anchor) const {
  using Eigen::Index;
  using Eigen::Matrix3d;
  const auto size = static_cast<Index>(3 * x.size());
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(size);
  std::vector<Eigen::Triplet<double>> entries;
  const auto at = [](std::size_t node) { return static_cast<Index>(3 * node); };
  const auto add = [&](std::size_t i, std::size_t j, const Matrix3d& block) {
    if (pinned_[i] || pinned_[j]) return;
    for (Index r = 0; r < 3; ++r)
      for (Index c = 0; c < 3; ++c) entries.emplace_back(at(i) + r, at(j) + c, block(r, c));
  };
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (Index axis = 0; axis < 3; ++axis)
      entries.emplace_back(at(i) + axis, at(i) + axis, pinned_[i] ? 1 : anchor.stiffness);
    if (!pinned_[i])
      forces.segment<3>(at(i)) =
          settings_.nodeMass * settings_.gravity + anchor.stiffness * (anchor.places[i] - x[i]);
  }
  for (const Spring& spring : springs_) {
    const Vec3 d = x[spring.b] - x[spring.a];
    const double length = d.norm();
    const Matrix3d along = d * d.transpose() / (length * length);
    // A compressed spring pushes across its direction, which would make the matrix indefinite.
    const double across = std::max(0.0, 1 - spring.length / length);
    const Matrix3d block = spring.stiffness * (along + across * (Matrix3d::Identity() - along));
    add(spring.a, spring.a, block);
    add(spring.b, spring.b, block);
    add(spring.a, spring.b, -block);
    add(spring.b, spring.a, -block);
    const Vec3 pull = spring.stiffness * (1 - spring.length / length) * d;
    if (!pinned_[spring.a]) forces.segment<3>(at(spring.a)) += pull;
    if (!pinned_[spring.b]) forces.segment<3>(at(spring.b)) -= pull;
  }
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
  if (factors.info() != Eigen::Success) throw std::runtime_error("the matrix of the springs is singular");
  const Eigen::VectorXd move = factors.solve(forces);
  const double before = energy(x, anchor), slope = forces.dot(move);
  for (double part = 1; part > 1e-6; part /= 2) {
    std::vector<Vec3> tried = x;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (!pinned_[i]) tried[i] += part * move.segment<3>(at(i));
    // Near the minimum the energy no longer resolves the gain.
    if (energy(tried, anchor) <= before - 1e-4 * part * slope + 1e-13 * std::abs(before)) {
      x = std::move(tried);
      break;
    }
  }
  return forces.norm();
}

double NewtonSheet::enough() const {
  return 1e-9 * settings_.nodeMass * settings_.gravity.norm();
}

std::vector<NewtonSheet::Vec3> NewtonSheet::balance(std::vector<Vec3> start) const {
  // The anchors hold flat cloth, which nothing else holds across its plane, and fade away.
  double stiffness = settings_.structural;
  for (int i = 0; i < 400; ++i) {
    const Anchor anchor{start, stiffness};
    if (improve(start, anchor) <= enough()) return start;
    stiffness *= 0.8;
  }
  throw std::runtime_error("Newton's method found no balance");
}

void NewtonSheet::step(std::vector<Vec3>& positions, std::vector<Vec3>& velocities, double damping,
                       double h) const {
  Anchor anchor{positions, settings_.nodeMass / (h * h)};
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (!pinned_[i]) anchor.places[i] += h * (1 - h * damping) * velocities[i];
  std::vector<Vec3> end = positions;
  for (int i = 0; improve(end, anchor) > enough(); ++i)
    if (i == 100) throw std::runtime_error("Newton's method did not end");
  for (std::size_t i = 0; i < positions.size(); ++i) velocities[i] = (end[i] - positions[i]) / h;
  positions = std::move(end);
}

}  // namespace clothstream::tests
