// SPDX-License-Identifier: MIT
// Substeps of XPBD with one sweep each: shaders/xpbd, in the order of model::springColours().
//
// The cloth is cut into blocks of 4x4 nodes. A lane is a block, so that four blocks are corrected at a time,
// with their nodes in local variables. Every row is stored as four planes: the columns 0, 4, 8, ..., then 1,
// 5, 9,
// ... and so on. The same column of four neighbouring blocks is then one vector in memory, also for the
// shifted blocks, so that nothing is gathered or shuffled.
#include <algorithm>
#include <array>
#include <cstddef>

#include "tests/bench/offload/cloth.h"
#include "tests/bench/offload/contact.h"

namespace clothstream::bench::offload {
namespace {

constexpr std::uint32_t kLanes = 4, kSize = 4;
// Vectors may begin one block before the first column and end beyond the last one; blocks may begin two rows
// before the first row.
constexpr std::uint32_t kBlocksBefore = 4, kBlocksBehind = 8, kRowsAbove = 2, kRowsBelow = 6;

// A kind of spring: model::XpbdSpring, divided by its resistance with two free ends and with one.
struct Rule {
  float stretch, damping;  // per resistance of two free ends
  float oneFree;           // resistance with two free ends divided by that with one
  float restLength;
};

Rule ruleOf(const Spring& spring, float restLength, const Settings& settings) {
  if (spring.stiffness == 0) return {0, 0, 0, restLength};
  const double h = settings.substep, compliance = 1 / double{spring.stiffness};
  const double memory = compliance / (h * h), damping = compliance * spring.damping / h;
  const auto resistance = [&](double inverseMasses) { return (1 + damping) * inverseMasses + memory; };
  const double both = resistance(2 * double{settings.inverseMass});
  return {static_cast<float>(1 / both), static_cast<float>(damping / both),
          static_cast<float>(both / resistance(double{settings.inverseMass})), restLength};
}

struct Rules {
  Rule alongRow, alongColumn, shear, bendRow, bendColumn;
};

// Nodes of four blocks.
template <std::size_t kCount>
struct Nodes {
  std::array<Triple, kCount> now, begun;
  std::array<Lanes, kCount> inverseMass;  // set only if kUniform is false
};

// Corrects the spring from node a to node b in four blocks, [MMC16] Eq. 17, 18 and 26. With one sweep per
// substep every multiplier starts at zero. kUniform: all nodes are free and have the same mass.
template <bool kUniform, std::size_t kCount>
[[gnu::always_inline]] inline void correct(Nodes<kCount>& nodes, std::size_t a, std::size_t b,
                                           const Rule& rule, Lanes mass) {
  const Triple d = nodes.now[b] - nodes.now[a];
  const Triple begun = nodes.begun[b] - nodes.begun[a];
  const Lanes squared = larger(dot(d, d), splat(1e-12f));
  const Lanes length = squareRoot(squared);
  const Lanes inverse = splat(1) / length;
  const Lanes begunAlong = dot(begun, d) * inverse, gain = begunAlong * inverse;
  // A growth of zero adds nothing; so does a spring that is not there.
  const Lanes side =
      splat(rule.stretch) * (length - splat(rule.restLength)) + splat(rule.damping) * (length - begunAlong);
  // Ends move along the line at the start unless the spring has turned far: shaders/xpbd/pull.glsl.
  const Triple way = select((gain > splat(0.5f)) & (gain < splat(1.5f)), (splat(2) - gain) * begun, d);
  if constexpr (kUniform) {
    const Triple move = (mass * side * inverse) * way;
    nodes.now[a] = nodes.now[a] + move;
    nodes.now[b] = nodes.now[b] - move;
  } else {
    const Lanes sum = nodes.inverseMass[a] + nodes.inverseMass[b];
    const Lanes scale = select(sum > splat(1.5f) * mass, splat(1), splat(rule.oneFree));
    const Triple pull = keep(sum > splat(0), (scale * side * inverse) * way);
    nodes.now[a] = nodes.now[a] + nodes.inverseMass[a] * pull;
    nodes.now[b] = nodes.now[b] - nodes.inverseMass[b] * pull;
  }
}

// Whether a spring crosses the middle of the block in either direction.
constexpr bool crosses(std::size_t a, std::size_t b) {
  return a / 8 != b / 8 || a % 4 / 2 != b % 4 / 2;
}

class Xpbd final : public Solver {
 public:
  Xpbd(std::uint32_t rows, std::uint32_t columns, const Settings& settings)
      : rows_(rows),
        columns_(columns),
        blocks_((columns + kSize - 1) / kSize),
        plane_((blocks_ + kLanes - 1) / kLanes * kLanes + kBlocksBefore + kBlocksBehind),
        stride_(kSize * plane_),
        settings_(settings),
        positions_(std::size_t{stride_} * (rows + kRowsAbove + kRowsBelow)),
        begun_(positions_.x.size()),
        velocities_(positions_.x.size()),
        inverseMasses_(positions_.x.size(), kAbsent) {
    const Settings& s = settings_;
    rules_ = {ruleOf(s.structural, s.columnSpacing, s), ruleOf(s.structural, s.rowSpacing, s),
              ruleOf(s.shear, s.diagonalSpacing, s), ruleOf(s.bend, 2 * s.columnSpacing, s),
              ruleOf(s.bend, 2 * s.rowSpacing, s)};
  }

  void setNode(std::uint32_t row, std::uint32_t column, const float* position, const float* velocity,
               float inverseMass) override {
    const std::size_t at = place(row, column);
    positions_.x[at] = position[0], positions_.y[at] = position[1], positions_.z[at] = position[2];
    velocities_.x[at] = velocity[0], velocities_.y[at] = velocity[1], velocities_.z[at] = velocity[2];
    inverseMasses_[at] = inverseMass;
    if (inverseMass == 0) lastPinnedRow_ = std::max(lastPinnedRow_, static_cast<int>(row));
  }

  void getNode(std::uint32_t row, std::uint32_t column, float* position, float* velocity) const override {
    const std::size_t at = place(row, column);
    position[0] = positions_.x[at], position[1] = positions_.y[at], position[2] = positions_.z[at];
    velocity[0] = velocities_.x[at], velocity[1] = velocities_.y[at], velocity[2] = velocities_.z[at];
  }

  void copyPositions(Arrays& to, std::uint32_t stride) const override {
    for (std::uint32_t row = 0; row < rows_; ++row)
      for (std::uint32_t block = 0; block < blocks_; block += kLanes) {
        const std::size_t from = planeAt(static_cast<int>(row), 0, static_cast<int>(block));
        const std::size_t at = std::size_t{row} * stride + kSize * block;
        interleave(&positions_.x[from], &to.x[at]);
        interleave(&positions_.y[from], &to.y[at]);
        interleave(&positions_.z[from], &to.z[at]);
      }
  }

  void substep(const Ball& ball) override {
    predict();
    const int rows = static_cast<int>(rows_), blocks = static_cast<int>(blocks_);
    for (int row = 0; row < rows; row += 4)
      for (int block = 0; block < blocks; block += 4)
        isPlain(row + 1, row + 4, block, block + 5) ? correctCorners<true>(row, block)
                                                    : correctCorners<false>(row, block);
    for (int row = -2; row < rows; row += 4)
      for (int block = 0; 4 * block - 2 < static_cast<int>(columns_); block += 4)
        isPlain(row, row + 3, block - 1, block + 4) ? correctBlocks<true, true>(row, block)
                                                    : correctBlocks<true, false>(row, block);
    for (int row = 0; row < rows; row += 4)
      for (int block = 0; block < blocks; block += 4)
        isPlain(row, row + 3, block, block + 4) ? correctBlocks<false, true>(row, block)
                                                : correctBlocks<false, false>(row, block);
    finish(ball);
  }

 private:
  // Index of a block in one of the four planes of a row.
  std::size_t planeAt(int row, std::uint32_t plane, int block) const {
    return static_cast<std::size_t>(row + static_cast<int>(kRowsAbove)) * stride_ + plane * plane_ +
           static_cast<std::size_t>(block + static_cast<int>(kBlocksBefore));
  }
  std::size_t place(std::uint32_t row, std::uint32_t column) const {
    return planeAt(static_cast<int>(row), column % kSize, static_cast<int>(column / kSize));
  }

  // Writes one vector of each plane as sixteen columns.
  void interleave(const float* planes, float* to) const {
    const Lanes a = load(planes), b = load(planes + plane_), c = load(planes + 2 * std::size_t{plane_}),
                d = load(planes + 3 * std::size_t{plane_});
    const Lanes ab0 = __builtin_shufflevector(a, b, 0, 4, 1, 5),
                ab1 = __builtin_shufflevector(a, b, 2, 6, 3, 7);
    const Lanes cd0 = __builtin_shufflevector(c, d, 0, 4, 1, 5),
                cd1 = __builtin_shufflevector(c, d, 2, 6, 3, 7);
    store(to, __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5));
    store(to + 4, __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7));
    store(to + 8, __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5));
    store(to + 12, __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7));
  }

  // Whether all nodes of these rows and blocks (`endBlock` excluded) are in the grid and free.
  bool isPlain(int firstRow, int lastRow, int firstBlock, int endBlock) const {
    return firstRow > lastPinnedRow_ && lastRow < static_cast<int>(rows_) && firstBlock >= 0 &&
           4 * endBlock <= static_cast<int>(columns_);
  }

  template <bool kUniform, std::size_t kCount>
  void loadNode(Nodes<kCount>& nodes, std::size_t node, std::size_t at) const {
    nodes.now[node] = positions_.at(at);
    nodes.begun[node] = begun_.at(at);
    if constexpr (!kUniform) nodes.inverseMass[node] = load(&inverseMasses_[at]);
  }

  // Two quads per block: across the right edge, and across the lower edge.
  template <bool kUniform>
  void correctCorners(int row, int block) {
    std::size_t at[8];
    for (int r = 0; r < 2; ++r) {
      at[2 * r] = planeAt(row + 1 + r, 3, block);
      at[2 * r + 1] = planeAt(row + 1 + r, 0, block + 1);
      at[4 + 2 * r] = planeAt(row + 3 + r, 1, block);
      at[5 + 2 * r] = planeAt(row + 3 + r, 2, block);
    }
    Nodes<8> nodes;
    for (std::size_t k = 0; k < 8; ++k) loadNode<kUniform>(nodes, k, at[k]);
    const Lanes mass = splat(settings_.inverseMass);
    correct<kUniform>(nodes, 0, 3, rules_.shear, mass);
    correct<kUniform>(nodes, 1, 2, rules_.shear, mass);
    correct<kUniform>(nodes, 4, 7, rules_.shear, mass);
    correct<kUniform>(nodes, 5, 6, rules_.shear, mass);
    for (std::size_t k = 0; k < 8; ++k) positions_.set(at[k], nodes.now[k]);
  }

  // All springs of four blocks, or those that cross a seam: blocks that begin two columns before `block`.
  template <bool kSeams, bool kUniform>
  void correctBlocks(int row, int block) {
    Nodes<kSize * kSize> nodes;
    const auto at = [&](std::uint32_t k) {
      const std::uint32_t r = k / kSize, c = k % kSize;
      if (!kSeams) return planeAt(row + static_cast<int>(r), c, block);
      return planeAt(row + static_cast<int>(r), (c + 2) % kSize, c < 2 ? block - 1 : block);
    };
#pragma unroll
    for (std::uint32_t k = 0; k < kSize * kSize; ++k) loadNode<kUniform>(nodes, k, at(k));
    const Lanes mass = splat(settings_.inverseMass);
    const auto spring = [&](std::size_t a, std::size_t b, const Rule& rule) __attribute__((always_inline)) {
      if (!kSeams || crosses(a, b)) correct<kUniform>(nodes, a, b, rule, mass);
    };
    // Columns, or rows, 0, 2, 1 in this order.
    constexpr std::size_t kInTurn[] = {0, 2, 1};
#pragma unroll
    for (std::size_t k = 0; k < 8; ++k)
      spring(k % 4 * kSize + k / 4, k % 4 * kSize + k / 4 + 2, rules_.bendRow);
#pragma unroll
    for (std::size_t a = 0; a < 8; ++a) spring(a, a + 2 * kSize, rules_.bendColumn);
#pragma unroll
    for (std::size_t k = 0; k < 9; ++k) {
      // Both even, then an odd column, then an odd row, then both odd.
      constexpr std::size_t kQuads[] = {0, 2, 8, 10, 1, 9, 4, 6, 5};
      const std::size_t a = kQuads[k];
      if (kSeams && !crosses(a, a + kSize + 1)) continue;
      correct<kUniform>(nodes, a, a + kSize + 1, rules_.shear, mass);
      correct<kUniform>(nodes, a + 1, a + kSize, rules_.shear, mass);
    }
#pragma unroll
    for (std::size_t part = 0; part < 2; ++part)
#pragma unroll
      for (std::size_t r = 0; r < kSize; ++r)
#pragma unroll
        for (std::size_t c = part; c < 3; c += 2) spring(r * kSize + c, r * kSize + c + 1, rules_.alongRow);
#pragma unroll
    for (std::size_t k = 0; k < 12; ++k)
      spring(kInTurn[k / 4] * kSize + k % 4, (kInTurn[k / 4] + 1) * kSize + k % 4, rules_.alongColumn);
#pragma unroll
    for (std::uint32_t k = 0; k < kSize * kSize; ++k) positions_.set(at(k), nodes.now[k]);
  }

  template <typename Use>
  void forEachVector(const Use& use) {
    for (std::uint32_t row = 0; row < rows_; ++row)
      for (std::uint32_t plane = 0; plane < kSize; ++plane)
        for (std::uint32_t block = 0; block < blocks_; block += kLanes)
          use(planeAt(static_cast<int>(row), plane, static_cast<int>(block)));
  }

  // All forces except those of springs.
  void predict() {
    forEachVector([&](std::size_t at) {
      const Mask free = load(&inverseMasses_[at]) > splat(0);
      Triple velocity = velocities_.at(at);
      Triple change = splat(-settings_.damping) * velocity;
      change.y += splat(settings_.gravity);
      velocity = velocity + keep(free, splat(settings_.substep) * change);
      const Triple position = positions_.at(at);
      velocities_.set(at, velocity);
      begun_.set(at, position);
      positions_.set(at, position + splat(settings_.substep) * velocity);
    });
  }

  // Velocities follow from positions without rounding those, as in finish_corrections.comp. Then nodes
  // collide.
  void finish(const Ball& ball) {
    const Lanes h = splat(settings_.substep), rate = splat(1 / settings_.substep);
    const Pointers positions = positions_.pointers(), velocities = velocities_.pointers();
    forEachVector([&](std::size_t at) {
      const Mask free = load(&inverseMasses_[at]) > splat(0);
      const Triple from = begun_.at(at);
      const Triple position = positions.at(at), velocity = velocities.at(at);
      const Triple change = keep(free, rate * (position - (from + h * velocity)));
      storeOutside(ball, settings_, free, from, position, velocity + change, at, positions, velocities);
    });
  }

  std::uint32_t rows_, columns_, blocks_, plane_, stride_;
  Settings settings_;
  Rules rules_;
  Arrays positions_, begun_, velocities_;
  std::vector<float> inverseMasses_;
  int lastPinnedRow_ = -1;
};

}  // namespace

std::unique_ptr<Solver> makeXpbd(std::uint32_t rows, std::uint32_t columns, const Settings& settings) {
  return std::make_unique<Xpbd>(rows, columns, settings);
}

}  // namespace clothstream::bench::offload
