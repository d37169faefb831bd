// SPDX-License-Identifier: MIT
// What offload.mjs calls: a cloth with its solver, ticks, and what a client draws of them.
#include <cmath>

#include "tests/bench/offload/cloth.h"

namespace clothstream::bench::offload {
namespace {

constexpr std::uint32_t kLanes = 4, kMargin = 32;

class ClientCloth {
 public:
  ClientCloth(bool xpbd, std::uint32_t rows, std::uint32_t columns, const Settings& settings)
      : rows_(rows),
        columns_(columns),
        stride_((columns + kLanes - 1) / kLanes * kLanes + kMargin),
        settings_(settings),
        solver_(xpbd ? makeXpbd(rows, columns, settings) : makeMassSpring(rows, columns, settings)),
        places_(std::size_t{stride_} * rows),
        quads_{Arrays(stride_ + kMargin), Arrays(stride_ + kMargin)},
        positions_(3 * (std::size_t{rows} * columns + kMargin)),
        normals_(positions_.size()) {}

  // Six floats a node, position and velocity, and its inverse mass.
  void setState(const float* state, const float* inverseMasses) {
    for (std::uint32_t row = 0; row < rows_; ++row)
      for (std::uint32_t column = 0; column < columns_; ++column) {
        const std::size_t node = std::size_t{row} * columns_ + column;
        solver_->setNode(row, column, state + 6 * node, state + 6 * node + 3, inverseMasses[node]);
      }
  }
  void getState(float* state) const {
    for (std::uint32_t row = 0; row < rows_; ++row)
      for (std::uint32_t column = 0; column < columns_; ++column) {
        float* node = state + 6 * (std::size_t{row} * columns_ + column);
        solver_->getNode(row, column, node, node + 3);
      }
  }

  // One tick: the sphere's centre moves in a straight line from start to end.
  void tick(std::uint32_t substeps, const float* start, const float* end) {
    for (std::uint32_t index = 0; index < substeps; ++index) {
      Ball ball;
      for (int i = 0; i < 3; ++i) {
        const float motion = end[i] - start[i];
        ball.before[i] = start[i] + static_cast<float>(index) / static_cast<float>(substeps) * motion;
        ball.after[i] = start[i] + static_cast<float>(index + 1) / static_cast<float>(substeps) * motion;
        ball.velocity[i] = motion / (settings_.substep * static_cast<float>(substeps));
      }
      solver_->substep(ball);
    }
  }

  // Three floats a vertex of positions and of normals, as the client core returns them. Four quads meet at a
  // vertex; the sum of their area vectors is that of compute_normals.comp.
  void present() {
    solver_->copyPositions(places_, stride_);
    Arrays *above = &quads_[0], *below = &quads_[1];
    for (std::uint32_t column = 0; column < stride_; column += kLanes) above->set(column, {});
    for (std::uint32_t row = 0; row < rows_; ++row) {
      measureQuads(row, *below);
      for (std::uint32_t column = 0; column < columns_; column += kLanes)
        presentVector(row, column, *above, *below);
      std::swap(above, below);
    }
  }

  const float* positions() const { return positions_.data(); }
  const float* normals() const { return normals_.data(); }

 private:
  // Area vectors of the quads below a row, one place behind their left column; zero beyond the edges. The
  // quad with corners a b above e f has (f - a) x (b - e).
  void measureQuads(std::uint32_t row, Arrays& quads) {
    for (std::uint32_t column = 0; column < columns_; column += kLanes) {
      Triple area{};
      if (row + 1 < rows_) {
        const std::size_t at = std::size_t{row} * stride_ + column, below = at + stride_;
        area = cross(places_.at(below + 1) - places_.at(at), places_.at(at + 1) - places_.at(below));
      }
      store(&quads.x[column + 1], area.x);
      store(&quads.y[column + 1], area.y);
      store(&quads.z[column + 1], area.z);
    }
    for (std::uint32_t column = columns_; column < columns_ + kLanes; ++column)
      quads.x[column] = quads.y[column] = quads.z[column] = 0;
  }

  // Vectors at the end of a row write beyond it; the next row overwrites that.
  void presentVector(std::uint32_t row, std::uint32_t column, const Arrays& above, const Arrays& below) {
    const Triple sum = above.at(column) + above.at(column + 1) + below.at(column) + below.at(column + 1);
    const Lanes squared = dot(sum, sum);
    const Mask vanishes = squared < splat(1e-30f);
    const Lanes inverse = splat(1) / squareRoot(larger(squared, splat(1e-30f)));
    const Triple normal = select(vanishes, Triple{{}, {}, splat(1)}, inverse * sum);
    const std::size_t out = 3 * (std::size_t{row} * columns_ + column);
    writeTriples(places_.at(std::size_t{row} * stride_ + column), &positions_[out]);
    writeTriples(normal, &normals_[out]);
  }

  static void writeTriples(const Triple& v, float* to) {
    const Lanes xy = __builtin_shufflevector(v.x, v.y, 0, 4, 1, 5);   // x0 y0 x1 y1
    const Lanes yz = __builtin_shufflevector(v.y, v.z, 1, 5, 2, 6);   // y1 z1 y2 z2
    const Lanes zx = __builtin_shufflevector(v.z, v.x, 0, 5, 2, 7);   // z0 x1 z2 x3
    const Lanes xy2 = __builtin_shufflevector(v.x, v.y, 2, 6, 3, 7);  // x2 y2 x3 y3
    const Lanes yz3 = __builtin_shufflevector(v.y, v.z, 3, 7, 3, 7);  // y3 z3
    store(to, __builtin_shufflevector(xy, zx, 0, 1, 4, 5));           // x0 y0 z0 x1
    store(to + 4, __builtin_shufflevector(yz, xy2, 0, 1, 4, 5));      // y1 z1 x2 y2
    store(to + 8, __builtin_shufflevector(zx, yz3, 2, 3, 4, 5));      // z2 x3 y3 z3
  }

  std::uint32_t rows_, columns_, stride_;
  Settings settings_;
  std::unique_ptr<Solver> solver_;
  Arrays places_, quads_[2];
  std::vector<float> positions_, normals_;
};

}  // namespace
}  // namespace clothstream::bench::offload

using clothstream::bench::offload::ClientCloth;
using clothstream::bench::offload::Settings;

extern "C" {

__attribute__((export_name("cloth_create"))) ClientCloth* cloth_create(std::uint32_t xpbd, std::uint32_t rows,
                                                                       std::uint32_t columns,
                                                                       const Settings* settings) {
  return new ClientCloth(xpbd != 0, rows, columns, *settings);
}
__attribute__((export_name("cloth_destroy"))) void cloth_destroy(ClientCloth* cloth) {
  delete cloth;
}
__attribute__((export_name("cloth_set"))) void cloth_set(ClientCloth* cloth, const float* state,
                                                         const float* inverseMasses) {
  cloth->setState(state, inverseMasses);
}
__attribute__((export_name("cloth_get"))) void cloth_get(const ClientCloth* cloth, float* state) {
  cloth->getState(state);
}
__attribute__((export_name("cloth_tick"))) void cloth_tick(ClientCloth* cloth, std::uint32_t substeps,
                                                           const float* start, const float* end) {
  cloth->tick(substeps, start, end);
}
__attribute__((export_name("cloth_present"))) void cloth_present(ClientCloth* cloth) {
  cloth->present();
}
__attribute__((export_name("cloth_positions"))) const float* cloth_positions(const ClientCloth* cloth) {
  return cloth->positions();
}
__attribute__((export_name("cloth_normals"))) const float* cloth_normals(const ClientCloth* cloth) {
  return cloth->normals();
}

}  // extern "C"
