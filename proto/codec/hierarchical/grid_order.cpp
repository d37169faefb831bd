// SPDX-License-Identifier: MIT
// Coding order of a grid: its corners, then level by level the vertices in between.
#include <utility>

#include "proto/codec/hierarchical/coding_order.h"

namespace clothstream::codec::hierarchical {
namespace {

// Rows or columns of a grid at one level: the multiples of a stride, and the last one.
class Axis {
 public:
  Axis(std::int64_t length, std::int64_t stride) : last_(length - 1), stride_(stride) {}

  std::int64_t count() const { return (last_ + stride_ - 1) / stride_ + 1; }
  std::int64_t at(std::int64_t index) const { return std::min(index * stride_, last_); }
  // True if this level adds the row or column: it lies between two of the level above.
  bool isNew(std::int64_t index) const { return index % 2 != 0 && index * stride_ < last_; }

 private:
  std::int64_t last_, stride_;
};

struct Offset {
  std::int64_t column, row;
};

constexpr Rank kNotOrdered = kRanks;

class GridOrder {
 public:
  GridOrder(std::uint32_t rows, std::uint32_t columns)
      : order_(std::size_t{rows} * columns), rows_(rows), columns_(columns) {
    order_.ranks.assign(order_.ranks.size(), kNotOrdered);
    addCorners();
    for (int level = static_cast<int>(kLevels) - 2; level >= 0; --level) {
      const std::int64_t stride = std::int64_t{1} << level;
      if (stride >= std::max(rows_, columns_)) continue;
      addLevel(static_cast<std::uint32_t>(level));
    }
    addNearest(std::int64_t{1} << kCoarseLevel);
    addNearest(1);
  }

  CodingOrder take() { return std::move(order_); }

 private:
  std::uint32_t vertexAt(std::int64_t column, std::int64_t row) const {
    return static_cast<std::uint32_t>(row * columns_ + column);
  }

  void addCorners() {
    const std::int64_t lastColumn = columns_ - 1, lastRow = rows_ - 1;
    const Offset corners[] = {{0, 0}, {lastColumn, lastRow}, {lastColumn, 0}, {0, lastRow}};
    std::array<std::uint32_t, 4> known;
    std::uint32_t count = 0;
    for (const Offset& corner : corners) {
      const std::uint32_t vertex = vertexAt(corner.column, corner.row);
      if (order_.ranks[vertex] != kNotOrdered) continue;
      Neighbours& neighbours = order_.neighbours[vertex];
      setParents(neighbours, std::span(known).first(count));
      setRing(neighbours, std::span(known).first(count));
      order_.ranks[vertex] = rankOfCorner(count);
      known[count++] = vertex;
    }
  }

  // Adds the vertices that are new in both directions, each between four old ones, then those new in one.
  void addLevel(std::uint32_t level) {
    const std::int64_t stride = std::int64_t{1} << level;
    const Axis column(columns_, stride), row(rows_, stride);
    for (const bool both : {true, false}) {
      for (std::int64_t r = 0; r < row.count(); ++r) {
        for (std::int64_t c = 0; c < column.count(); ++c) {
          if (column.isNew(c) + row.isNew(r) != (both ? 2 : 1)) continue;
          add(column, row, c, r, both, rankOf(level, both, 0));
        }
      }
    }
  }

  // The ring holds only opposite pairs, so that its mean is at the vertex.
  void add(const Axis& column, const Axis& row, std::int64_t c, std::int64_t r, bool both, Rank rank) {
    constexpr std::array<Offset, 4> kAcross{{{-1, -1}, {1, 1}, {-1, 1}, {1, -1}}},
        kAlong{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    constexpr std::array<Offset, 4> kRoundAcross{{{-3, -1}, {-3, 1}, {-1, -3}, {1, -3}}},
        kRoundAlong{{{-2, -1}, {2, -1}, {-1, -2}, {1, -2}}};
    const auto known = [&](const Offset& offset, std::int64_t times) -> std::uint32_t {
      const std::int64_t nc = c + times * offset.column, nr = r + times * offset.row;
      if (nc < 0 || nr < 0 || nc >= column.count() || nr >= row.count()) return kNoVertex;
      const std::uint32_t vertex = vertexAt(column.at(nc), row.at(nr));
      const Rank other = order_.ranks[vertex];
      return other == kNotOrdered || other <= rank ? kNoVertex : vertex;
    };
    std::vector<std::uint32_t> parents, ring;
    const auto addPair = [&](const Offset& offset, std::int64_t times) {
      const std::uint32_t before = known(offset, -times), after = known(offset, times);
      if (before != kNoVertex && after != kNoVertex) ring.insert(ring.end(), {before, after});
    };
    for (const Offset& offset : both ? kAcross : kAlong) {
      if (const std::uint32_t vertex = known(offset, 1); vertex != kNoVertex) parents.push_back(vertex);
    }
    const std::uint32_t vertex = vertexAt(column.at(c), row.at(r));
    Neighbours& neighbours = order_.neighbours[vertex];
    setParents(neighbours, parents);
    if (parents.size() == 3) {
      // At a border the mean is half-way between the two neighbours along it. The first is a parent twice.
      constexpr std::int16_t half = 2 * kEqualWeight;
      const bool alongRow = column.isNew(c);
      neighbours.weights = alongRow ? std::array<std::int16_t, 4>{half, half, 0, 0}
                                    : std::array<std::int16_t, 4>{0, half, 0, half};
      addPair(alongRow ? Offset{1, 0} : Offset{0, 1}, 3);
    } else {
      for (const Offset& offset : both ? kRoundAcross : kRoundAlong) addPair(offset, -1);
    }
    setRing(neighbours, ring);
    order_.ranks[vertex] = rank;
  }

  // Uses the finest level; for coarse vertices the finest coarse level.
  void addNearest(std::int64_t stride) {
    const bool coarse = stride > 1;
    const Axis column(columns_, stride), row(rows_, stride);
    for (std::int64_t r = 0; r < row.count(); ++r) {
      for (std::int64_t c = 0; c < column.count(); ++c) {
        const std::uint32_t vertex = vertexAt(column.at(c), row.at(r));
        if (isCoarse(order_.ranks[vertex]) != coarse) continue;
        const auto at = [&](std::int64_t nc, std::int64_t nr) {
          const bool inside = nc >= 0 && nr >= 0 && nc < column.count() && nr < row.count();
          return inside ? vertexAt(column.at(nc), row.at(nr)) : vertex;
        };
        order_.nearest[vertex] = {at(c - 1, r), at(c + 1, r), at(c, r - 1), at(c, r + 1)};
      }
    }
  }

  CodingOrder order_;
  std::int64_t rows_, columns_;
};

}  // namespace

CodingOrder orderGrid(std::uint32_t rows, std::uint32_t columns) {
  return GridOrder(rows, columns).take();
}

}  // namespace clothstream::codec::hierarchical
