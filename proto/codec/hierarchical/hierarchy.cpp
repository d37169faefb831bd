// SPDX-License-Identifier: MIT
// The order in which codec 2 codes vertices.
#include "proto/codec/hierarchical/hierarchy.h"

#include <algorithm>
#include <bit>
#include <span>

namespace clothstream::codec::hierarchical {
namespace {

constexpr std::uint32_t kNotCoded = ~0u;

// Rows or columns of a grid at one level: the multiples of a stride, and the last one.
class Axis {
 public:
  Axis(std::int64_t length, std::int64_t stride) : last_(length - 1), stride_(stride) {}

  std::int64_t count() const { return (last_ + stride_ - 1) / stride_ + 1; }
  std::int64_t at(std::int64_t index) const { return std::min(index * stride_, last_); }
  // Whether it comes in at this level: it is between two of the level above.
  bool isNew(std::int64_t index) const { return index % 2 != 0 && index * stride_ < last_; }

 private:
  std::int64_t last_, stride_;
};

struct Offset {
  std::int64_t column, row;
};

class Builder {
 public:
  Builder(Hierarchy& hierarchy, std::uint32_t vertexCount) : hierarchy_(hierarchy), none_(vertexCount) {}

  bool allocate(std::size_t phases) {
    return slotOf_.allocate(none_) && hierarchy_.vertexOf.allocate(none_) &&
           hierarchy_.neighbours.allocate(none_) && phases_.allocate(phases);
  }

  void addGrid(std::uint32_t first, std::uint32_t rows, std::uint32_t columns) {
    first_ = first;
    rows_ = rows;
    columns_ = columns;
    std::fill_n(slotOf_.data() + first, rows * columns, kNotCoded);
    addCorners();
    for (std::int64_t stride = std::int64_t{1} << 30; stride > 0; stride /= 2) {
      if (stride >= std::max(rows, columns)) continue;
      addLevel(stride);
    }
    addNearest();
  }

  bool finish() {
    if (!hierarchy_.phases.allocate(phaseCount_)) return false;
    std::copy_n(phases_.data(), phaseCount_, hierarchy_.phases.data());
    return true;
  }

 private:
  std::uint32_t vertexAt(std::int64_t column, std::int64_t row) const {
    return first_ + static_cast<std::uint32_t>(row * columns_ + column);
  }

  void addCorners() {
    const std::int64_t lastColumn = columns_ - 1, lastRow = rows_ - 1;
    const Offset corners[] = {{0, 0}, {lastColumn, lastRow}, {lastColumn, 0}, {0, lastRow}};
    Neighbours neighbours;
    std::array<std::uint32_t, 4> known;
    std::size_t count = 0;
    for (const Offset& corner : corners) {
      const std::uint32_t vertex = vertexAt(corner.column, corner.row);
      if (slotOf_[vertex] != kNotCoded) continue;
      setParents(neighbours, std::span(known).first(count));
      setRing(neighbours, std::span(known).first(count));
      known[count++] = next_;
      openPhase(kWeightClasses);
      code(vertex, neighbours);
    }
  }

  // First what is new both ways, between four old ones across, then what is new one way.
  void addLevel(std::int64_t stride) {
    const std::uint32_t weightClass = stride == 1 ? 0 : stride == 2 ? 2 : 4;
    const Axis column(columns_, stride), row(rows_, stride);
    const std::array<Offset, 4> across{{{-1, -1}, {1, 1}, {-1, 1}, {1, -1}}};
    const std::array<Offset, 8> roundAcross{
        {{-3, -1}, {3, -1}, {-3, 1}, {3, 1}, {-1, -3}, {1, -3}, {-1, 3}, {1, 3}}};
    const std::array<Offset, 4> along{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    const std::array<Offset, 8> roundAlong{
        {{-2, -1}, {2, -1}, {-2, 1}, {2, 1}, {-1, -2}, {1, -2}, {-1, 2}, {1, 2}}};
    openPhase(weightClass);
    for (std::int64_t r = 0; r < row.count(); ++r) {
      for (std::int64_t c = 0; c < column.count(); ++c) {
        if (column.isNew(c) && row.isNew(r)) add(column, row, c, r, across, roundAcross);
      }
    }
    openPhase(weightClass + 1);
    for (std::int64_t r = 0; r < row.count(); ++r) {
      for (std::int64_t c = 0; c < column.count(); ++c) {
        if (column.isNew(c) != row.isNew(r)) add(column, row, c, r, along, roundAlong);
      }
    }
  }

  void add(const Axis& column, const Axis& row, std::int64_t c, std::int64_t r,
           const std::array<Offset, 4>& near, const std::array<Offset, 8>& far) {
    std::array<std::uint32_t, 8> known;
    const auto collect = [&](std::span<const Offset> offsets) {
      std::size_t count = 0;
      for (const Offset& offset : offsets) {
        const std::int64_t nc = c + offset.column, nr = r + offset.row;
        if (nc < 0 || nr < 0 || nc >= column.count() || nr >= row.count()) continue;
        const std::uint32_t slot = slotOf_[vertexAt(column.at(nc), row.at(nr))];
        if (slot < phases_[phaseCount_ - 1].begin) known[count++] = slot;
      }
      return std::span<const std::uint32_t>(known).first(count);
    };
    Neighbours neighbours;
    setParents(neighbours, collect(near));
    setRing(neighbours, collect(far));
    code(vertexAt(column.at(c), row.at(r)), neighbours);
  }

  void setParents(Neighbours& neighbours, std::span<const std::uint32_t> known) const {
    constexpr std::uint8_t kChoice[5][4] = {
        {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 1, 0, 1}, {0, 1, 0, 2}, {0, 1, 2, 3}};
    for (std::size_t i = 0; i < 4; ++i) {
      neighbours.parents[i] = known.empty() ? none_ : known[kChoice[known.size()][i]];
    }
  }

  // Where there is none: the parents once more, so that the two averages are the same.
  static void setRing(Neighbours& neighbours, std::span<const std::uint32_t> known) {
    if (known.size() < 3) known = neighbours.parents;
    for (std::size_t i = 0; i < neighbours.ring.size(); ++i) neighbours.ring[i] = known[i % known.size()];
  }

  void openPhase(std::uint32_t weightClass) {
    if (phaseCount_ > 0 && phases_[phaseCount_ - 1].begin == next_) --phaseCount_;
    phases_[phaseCount_++] = {next_, next_, weightClass};
  }

  void code(std::uint32_t vertex, const Neighbours& neighbours) {
    slotOf_[vertex] = next_;
    hierarchy_.vertexOf[next_] = vertex;
    hierarchy_.neighbours[next_] = neighbours;
    phases_[phaseCount_ - 1].end = ++next_;
  }

  void addNearest() {
    for (std::int64_t row = 0; row < rows_; ++row) {
      for (std::int64_t column = 0; column < columns_; ++column) {
        const std::uint32_t slot = slotOf_[vertexAt(column, row)];
        const auto at = [&](std::int64_t c, std::int64_t r) {
          const bool inside = c >= 0 && r >= 0 && c < columns_ && r < rows_;
          return inside ? slotOf_[vertexAt(c, r)] : slot;
        };
        hierarchy_.neighbours[slot].nearest = {at(column - 1, row), at(column + 1, row), at(column, row - 1),
                                               at(column, row + 1)};
      }
    }
  }

  Hierarchy& hierarchy_;
  std::uint32_t none_;
  Array<std::uint32_t> slotOf_;
  Array<Phase> phases_;
  std::size_t phaseCount_ = 0;
  std::uint32_t next_ = 0;
  std::uint32_t first_ = 0;
  std::int64_t rows_ = 0, columns_ = 0;
};

}  // namespace

bool Hierarchy::build(const StreamLayout& layout) {
  // Four corners, and two phases a level.
  constexpr std::size_t kMaxPhasesPerCloth = 4 + 2 * 32;
  Builder builder(*this, layout.vertexCount());
  if (!builder.allocate(kMaxPhasesPerCloth * layout.cloths.size() + 1)) return false;
  std::uint32_t first = 0;
  for (const ClothLayout& cloth : layout.cloths) {
    const bool grid = cloth.rows > 0;
    builder.addGrid(first, grid ? cloth.rows : 1, grid ? cloth.columns : cloth.vertexCount);
    first += cloth.vertexCount;
  }
  return builder.finish();
}

}  // namespace clothstream::codec::hierarchical
