// SPDX-License-Identifier: MIT
// A step of ACAD written from the paper alone.
#include "tests/simulation/paper_acad.h"

#include <Eigen/QR>
#include <cmath>

namespace clothstream::tests {
namespace {

Eigen::Index at(std::size_t node) {
  return static_cast<Eigen::Index>(3 * node);
}

Eigen::Vector3d node(const Eigen::VectorXd& all, std::size_t number) {
  return all.segment<3>(at(number));
}

}  // namespace

std::vector<std::size_t> paperConstraints(const PaperSystem& system, const PaperState& state) {
  std::vector<std::size_t> active;
  for (std::size_t i = 0; i < system.springs.size(); ++i) {
    const PaperSpring& spring = system.springs[i];
    const double length = (node(state.q, spring.one) - node(state.q, spring.two)).norm();
    if (spring.mayConstrain && length > (1 + system.threshold) * spring.restLength) active.push_back(i);
  }
  return active;
}

PaperState paperStep(const PaperSystem& system, const PaperState& state, double dt) {
  const Eigen::Index n = state.q.size();
  const std::vector<std::size_t> active = paperConstraints(system, state);
  std::vector<bool> isActive(system.springs.size(), false);
  for (const std::size_t i : active) isActive[i] = true;

  Eigen::VectorXd inverseMass(n), force(n);
  for (std::size_t i = 0; i < system.fixed.size(); ++i) {
    const double mass = system.masses[static_cast<Eigen::Index>(i)];
    inverseMass.segment<3>(at(i)).setConstant(system.fixed[i] ? 0 : 1 / mass);
    force.segment<3>(at(i)) = mass * (system.gravity - system.drag * node(state.velocity, i));
  }
  // Eq. 1 and 2, of the springs that are not constraints.
  for (std::size_t i = 0; i < system.springs.size(); ++i) {
    if (isActive[i]) continue;
    const PaperSpring& spring = system.springs[i];
    const Eigen::Vector3d across = node(state.q, spring.two) - node(state.q, spring.one);
    const Eigen::Vector3d direction = across.normalized();
    const double speed = direction.dot(node(state.velocity, spring.two) - node(state.velocity, spring.one));
    const Eigen::Vector3d pull =
        (spring.stiffness * (across.norm() - spring.restLength) + spring.damping * speed) * direction;
    force.segment<3>(at(spring.one)) += pull;
    force.segment<3>(at(spring.two)) -= pull;
  }
  // Eq. 3 to 5.
  const auto m = static_cast<Eigen::Index>(active.size());
  Eigen::VectorXd phi(m);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(m, n);
  for (Eigen::Index row = 0; row < m; ++row) {
    const PaperSpring& spring = system.springs[active[static_cast<std::size_t>(row)]];
    const Eigen::Vector3d between = node(state.q, spring.one) - node(state.q, spring.two);
    phi[row] = between.squaredNorm() - spring.restLength * spring.restLength;
    jacobian.block<1, 3>(row, at(spring.one)) = 2 * between.transpose();
    jacobian.block<1, 3>(row, at(spring.two)) = -2 * between.transpose();
  }
  // A constraint between two fixed nodes has no row in the system; its multiplier is zero in the shortest
  // solution. Eq. 11; the constraints do not depend on time by themselves.
  const Eigen::VectorXd side =
      phi / (dt * dt) + jacobian * (state.velocity / dt + inverseMass.cwiseProduct(force));
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(m);
  if (m > 0) {
    const Eigen::MatrixXd matrix = jacobian * inverseMass.asDiagonal() * jacobian.transpose();
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
    solver.setThreshold(1e-10);
    solver.compute(matrix);
    lambda = solver.solve(side);
  }
  // Eq. 7 and 8.
  PaperState next;
  next.velocity = state.velocity + dt * inverseMass.cwiseProduct(force - jacobian.transpose() * lambda);
  next.q = state.q + dt * next.velocity;
  return next;
}

std::vector<PaperSpring> paperSprings(const PaperGrid& grid) {
  std::vector<PaperSpring> springs;
  const auto number = [&](std::size_t row, std::size_t column) { return row * grid.columns + column; };
  const auto add = [&](std::size_t one, std::size_t two, PaperSpring kind, double right, double down) {
    kind.one = one;
    kind.two = two;
    kind.restLength = std::hypot(right * grid.columnSpacing, down * grid.rowSpacing);
    springs.push_back(kind);
  };
  for (std::size_t row = 0; row < grid.rows; ++row)
    for (std::size_t column = 0; column < grid.columns; ++column) {
      const bool right = column + 1 < grid.columns, down = row + 1 < grid.rows;
      if (right) add(number(row, column), number(row, column + 1), grid.structural, 1, 0);
      if (down) add(number(row, column), number(row + 1, column), grid.structural, 0, 1);
      if (right && down) add(number(row, column), number(row + 1, column + 1), grid.shear, 1, 1);
      if (right && down) add(number(row, column + 1), number(row + 1, column), grid.shear, 1, 1);
      if (column + 2 < grid.columns) add(number(row, column), number(row, column + 2), grid.bend, 2, 0);
      if (row + 2 < grid.rows) add(number(row, column), number(row + 2, column), grid.bend, 0, 2);
    }
  return springs;
}

}  // namespace clothstream::tests
