// SPDX-License-Identifier: MIT
// Substeps of the mass-spring model: shaders/mass_spring without air.
//
// One pass over the grid does everything, in place. Each of the six springs that lead right or down from a
// node is computed once. Its force on the other end waits in registers (same row) or in a buffer of one row
// (rows below). After a vector of nodes is done, nothing reads its old state any more, so the new state
// replaces it.
#include <cstddef>

#include "tests/bench/offload/cloth.h"
#include "tests/bench/offload/contact.h"

namespace clothstream::bench::offload {
namespace {

constexpr std::uint32_t kLanes = 4;
// Floats behind a row, and rows below the grid, that loads may touch.
constexpr std::uint32_t kMargin = 8, kRowsBelow = 2;

struct Node {
  Triple position, velocity;
};

// A spring with the products that are the same for all nodes.
struct Rule {
  Lanes stiffness, tension, damping;  // tension: stiffness times rest length
};

Rule ruleOf(const Spring& spring, float restLength, bool exists = true) {
  if (!exists) return {};
  return {splat(spring.stiffness), splat(spring.stiffness * restLength), splat(spring.damping)};
}

// Force on `node` of the spring to `other`, [Va21] Eq. 1.
inline Triple springForce(const Node& node, const Node& other, const Rule& rule) {
  const Triple d = other.position - node.position;
  const Lanes inverseSquared = splat(1) / larger(dot(d, d), splat(1e-12f));
  const Lanes inverse = squareRoot(inverseSquared);
  const Lanes scale = rule.stiffness - rule.tension * inverse +
                      rule.damping * dot(other.velocity - node.velocity, d) * inverseSquared;
  return scale * d;
}

class MassSpring final : public Solver {
 public:
  MassSpring(std::uint32_t rows, std::uint32_t columns, const Settings& settings)
      : rows_(rows),
        columns_(columns),
        stride_((columns + kLanes - 1) / kLanes * kLanes + kMargin),
        settings_(settings),
        positions_(std::size_t{stride_} * (rows + kRowsBelow)),
        velocities_(positions_.x.size()),
        inverseMasses_(positions_.x.size(), 0),
        fromAbove_(stride_),
        fromFarAbove_{Arrays(stride_), Arrays(stride_)},
        hasRight_(stride_),
        hasRight2_(stride_) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      hasRight_[column] = column + 1 < columns ? -1 : 0;
      hasRight2_[column] = column + 2 < columns ? -1 : 0;
    }
  }

  void setNode(std::uint32_t row, std::uint32_t column, const float* position, const float* velocity,
               float inverseMass) override {
    const std::size_t at = std::size_t{row} * stride_ + column;
    positions_.x[at] = position[0], positions_.y[at] = position[1], positions_.z[at] = position[2];
    velocities_.x[at] = velocity[0], velocities_.y[at] = velocity[1], velocities_.z[at] = velocity[2];
    inverseMasses_[at] = inverseMass;
  }

  void getNode(std::uint32_t row, std::uint32_t column, float* position, float* velocity) const override {
    const std::size_t at = std::size_t{row} * stride_ + column;
    position[0] = positions_.x[at], position[1] = positions_.y[at], position[2] = positions_.z[at];
    velocity[0] = velocities_.x[at], velocity[1] = velocities_.y[at], velocity[2] = velocities_.z[at];
  }

  void copyPositions(Arrays& to, std::uint32_t stride) const override {
    for (std::uint32_t row = 0; row < rows_; ++row)
      for (std::uint32_t column = 0; column < columns_; column += kLanes)
        to.set(std::size_t{row} * stride + column, positions_.at(std::size_t{row} * stride_ + column));
  }

  void substep(const Ball& ball) override {
    for (Arrays* buffer : {&fromAbove_, &fromFarAbove_[0], &fromFarAbove_[1]})
      for (std::uint32_t column = 0; column < columns_; column += kLanes) buffer->set(column, {});
    for (std::uint32_t row = 0; row < rows_; ++row) advanceRow(row, ball);
  }

 private:
  // Forces of the previous vector of the row on the nodes to its right.
  struct ToTheRight {
    Triple along{}, bend{}, falling{}, rising{};
  };

  // State and constants of the loop over a row.
  struct Row {
    Pointers positions, velocities;    // of its first node
    Pointers fromAbove, fromFarAbove;  // forces of the rows above, then on the rows below
    const float* inverseMasses;
    const int *hasRight, *hasRight2;
    std::size_t stride;
    Rule alongRow, alongColumn, shear, bendRow, bendColumn;
    Settings settings;
    Ball ball;

    [[gnu::always_inline]] Node at(std::size_t index) const {
      return {positions.at(index), velocities.at(index)};
    }
  };

  static Pointers from(Arrays& arrays, std::size_t first) {
    return {&arrays.x[first], &arrays.y[first], &arrays.z[first]};
  }

  void advanceRow(std::uint32_t number, const Ball& ball) {
    const std::size_t first = std::size_t{number} * stride_;
    const Settings& s = settings_;
    const Row row{from(positions_, first),
                  from(velocities_, first),
                  fromAbove_.pointers(),
                  fromFarAbove_[number % 2].pointers(),
                  &inverseMasses_[first],
                  hasRight_.data(),
                  hasRight2_.data(),
                  stride_,
                  ruleOf(s.structural, s.columnSpacing),
                  ruleOf(s.structural, s.rowSpacing, number + 1 < rows_),
                  ruleOf(s.shear, s.diagonalSpacing, number + 1 < rows_),
                  ruleOf(s.bend, 2 * s.columnSpacing),
                  ruleOf(s.bend, 2 * s.rowSpacing, number + 2 < rows_),
                  s,
                  ball};
    ToTheRight before;
    std::uint32_t column = 0;
    // No spring of these nodes ends beyond the last column.
    for (; column + kLanes + 2 <= columns_; column += kLanes) advance<false>(row, column, before);
    for (; column < columns_; column += kLanes) advance<true>(row, column, before);
  }

  template <bool kAtEdge>
  [[gnu::always_inline]] static void advance(const Row& row, std::size_t column, ToTheRight& before) {
    const std::size_t below = column + row.stride;
    const Node here = row.at(column), right = row.at(column + 1), down = row.at(below);
    ToTheRight now;
    now.along = springForce(here, right, row.alongRow);
    now.bend = springForce(here, row.at(column + 2), row.bendRow);
    now.falling = springForce(here, row.at(below + 1), row.shear);
    now.rising = springForce(right, down, row.shear);  // on the right node
    if constexpr (kAtEdge) {
      const Mask hasRight = *reinterpret_cast<const Mask*>(row.hasRight + column);
      now.along = keep(hasRight, now.along);
      now.falling = keep(hasRight, now.falling);
      now.rising = keep(hasRight, now.rising);
      now.bend = keep(*reinterpret_cast<const Mask*>(row.hasRight2 + column), now.bend);
    }
    const Triple toDown = springForce(here, down, row.alongColumn);
    const Triple toFarDown = springForce(here, row.at(below + row.stride), row.bendColumn);

    Triple force = row.fromAbove.at(column) + row.fromFarAbove.at(column);
    force = force + now.along + now.bend + now.falling + toDown + toFarDown;
    force = force - oneEarlier(before.along, now.along) - twoEarlier(before.bend, now.bend) +
            oneEarlier(before.rising, now.rising);
    row.fromAbove.set(column, Triple{} - toDown - now.rising - oneEarlier(before.falling, now.falling));
    row.fromFarAbove.set(column, Triple{} - toFarDown);
    before = now;
    move(row, column, here, force);
  }

  // Semi-implicit Euler. No force moves a pinned node.
  [[gnu::always_inline]] static void move(const Row& row, std::size_t column, const Node& node,
                                          const Triple& force) {
    const Lanes inverseMass = load(row.inverseMasses + column), step = splat(row.settings.substep);
    const Mask free = inverseMass > splat(0);
    Triple change = inverseMass * force - splat(row.settings.damping) * node.velocity;
    change.y += splat(row.settings.gravity);
    const Triple velocity = node.velocity + keep(free, step * change);
    storeOutside(row.ball, row.settings, free, node.position, node.position + step * velocity, velocity,
                 column, row.positions, row.velocities);
  }

  std::uint32_t rows_, columns_, stride_;
  Settings settings_;
  Arrays positions_, velocities_;
  std::vector<float> inverseMasses_;
  Arrays fromAbove_, fromFarAbove_[2];  // forces on the next row, and on the rows after it
  std::vector<int> hasRight_, hasRight2_;
};

}  // namespace

std::unique_ptr<Solver> makeMassSpring(std::uint32_t rows, std::uint32_t columns, const Settings& settings) {
  return std::make_unique<MassSpring>(rows, columns, settings);
}

}  // namespace clothstream::bench::offload
