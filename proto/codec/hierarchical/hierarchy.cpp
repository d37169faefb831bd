// SPDX-License-Identifier: MIT
// The order in which codec 2 codes vertices.
#include "proto/codec/hierarchical/hierarchy.h"

#include <algorithm>
#include <bit>
#include <span>
#include <utility>
#include <vector>

namespace clothstream::codec::hierarchical {
namespace {

constexpr std::uint32_t kNotCoded = ~0u;

// Of a level of a mesh: where a search for others ends. They bound the work, whatever the mesh is.
constexpr std::size_t kMaxVisited = 64, kMaxFound = 12;
constexpr std::size_t kMaxMeshLevels = 24, kFewVertices = 16;
constexpr std::size_t kMeshPhases = 5;  // of a level

// Which vertices of a level of a mesh are near which others: the nearest first, then by number.
struct Graph {
  std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    return std::span(others).subspan(starts[vertex], starts[vertex + 1] - starts[vertex]);
  }

  std::vector<std::size_t> starts;  // by vertex, and the end
  std::vector<std::uint32_t> others;
};

// Those that have an edge in common: round each vertex from triangle to triangle, as far as that goes.
Graph edgesOf(const ClothLayout& cloth) {
  // Each triangle leads, round each of its corners, from one of the other two to the last.
  struct Link {
    std::uint32_t centre, from, to;
    auto operator<=>(const Link&) const = default;  // NOLINT(modernize-use-nullptr): of what is generated
  };
  std::vector<Link> links;
  links.reserve(cloth.triangles.size());
  for (std::size_t i = 0; i < cloth.triangles.size(); i += 3) {
    const std::uint32_t* t = &cloth.triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (std::size_t c = 0; c < 3; ++c) links.push_back({t[c], t[(c + 1) % 3], t[(c + 2) % 3]});
  }
  std::sort(links.begin(), links.end());
  Graph graph;
  graph.starts.assign(std::size_t{cloth.vertexCount} + 1, 0);
  std::vector<std::uint32_t> seen(cloth.vertexCount, kNotCoded);
  std::vector<std::uint32_t> ends;
  auto link = links.begin();
  for (std::uint32_t v = 0; v < cloth.vertexCount; ++v) {
    const auto first = link;
    while (link != links.end() && link->centre == v) ++link;
    const auto walk = [&](std::uint32_t at) {
      while (seen[at] != v) {
        seen[at] = v;
        graph.others.push_back(at);
        const auto next = std::lower_bound(first, link, at,
                                           [](const Link& l, std::uint32_t from) { return l.from < from; });
        if (next != link && next->from == at) at = next->to;
      }
    };
    // A border's first neighbour is no triangle's last.
    ends.clear();
    for (auto l = first; l != link; ++l) ends.push_back(l->to);
    std::sort(ends.begin(), ends.end());
    for (auto l = first; l != link; ++l) {
      if (!std::binary_search(ends.begin(), ends.end(), l->from)) walk(l->from);
    }
    for (auto l = first; l != link; ++l) walk(l->from);
    for (auto l = first; l != link; ++l) walk(l->to);
    graph.starts[v + 1] = graph.others.size();
  }
  return graph;
}

// Breadth-first searches in the graphs of one mesh.
class Search {
 public:
  explicit Search(std::uint32_t vertices) : seen_(vertices, 0) {}

  // The first of those round `start` that are wanted, at most kMaxFound, up to so many edges away.
  template <typename IsWanted>
  std::span<const std::uint32_t> find(const Graph& graph, std::uint32_t start, std::size_t edges,
                                      IsWanted&& isWanted) {
    ++search_;
    visited_.assign(1, start);
    seen_[start] = search_;
    found_.clear();
    std::size_t next = 0;
    for (std::size_t edge = 0; edge < edges; ++edge) {
      for (const std::size_t end = visited_.size(); next < end; ++next) {
        for (const std::uint32_t other : graph.of(visited_[next])) {
          if (seen_[other] == search_) continue;
          if (visited_.size() == kMaxVisited || found_.size() == kMaxFound) return found_;
          seen_[other] = search_;
          visited_.push_back(other);
          if (isWanted(other)) found_.push_back(other);
        }
      }
    }
    return found_;
  }

 private:
  std::vector<std::uint32_t> seen_;  // by vertex: the last search that came by
  std::uint32_t search_ = 0;
  std::vector<std::uint32_t> visited_, found_;
};

// In this order those that have no neighbour among those taken before.
std::vector<std::uint32_t> takeApart(const Graph& graph, std::span<const std::uint32_t> vertices,
                                     std::vector<bool>& taken) {
  std::vector<std::uint32_t> apart;
  for (const std::uint32_t vertex : vertices) {
    const auto near = graph.of(vertex);
    if (std::any_of(near.begin(), near.end(), [&](std::uint32_t other) { return taken[other]; })) continue;
    taken[vertex] = true;
    apart.push_back(vertex);
  }
  return apart;
}

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
           hierarchy_.neighbours.allocate(none_) && hierarchy_.nearest.allocate(none_) &&
           phases_.allocate(phases);
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

  // Each level is what of the level below stands apart.
  void addMesh(std::uint32_t first, const ClothLayout& cloth) {
    first_ = first;
    std::fill_n(slotOf_.data() + first, cloth.vertexCount, kNotCoded);
    struct Level {
      std::vector<std::uint32_t> vertices;
      Graph graph;
    };
    std::vector<Level> levels(1);
    levels[0].graph = edgesOf(cloth);
    for (std::uint32_t v = 0; v < cloth.vertexCount; ++v) levels[0].vertices.push_back(v);
    Search search(cloth.vertexCount);
    while (levels.size() < kMaxMeshLevels && levels.back().vertices.size() > kFewVertices) {
      const Level& fine = levels.back();
      std::vector<bool> taken(cloth.vertexCount);
      Level coarse{takeApart(fine.graph, fine.vertices, taken), {}};
      if (coarse.vertices.size() == fine.vertices.size()) break;
      coarse.graph.starts.assign(std::size_t{cloth.vertexCount} + 1, 0);
      std::size_t next = 0;
      for (std::uint32_t v = 0; v < cloth.vertexCount; ++v) {
        if (next < coarse.vertices.size() && coarse.vertices[next] == v) {
          ++next;
          const auto near = search.find(fine.graph, v, 3, [&](std::uint32_t other) { return taken[other]; });
          coarse.graph.others.insert(coarse.graph.others.end(), near.begin(), near.end());
        }
        coarse.graph.starts[v + 1] = coarse.graph.others.size();
      }
      levels.push_back(std::move(coarse));
    }
    addCoarsest(levels.back().vertices);
    for (std::size_t level = levels.size() - 1; level-- > 0;) {
      const auto& [vertices, graph] = levels[level];
      const std::uint32_t weightClass = 2 * static_cast<std::uint32_t>(std::min<std::size_t>(level, 2));
      std::vector<std::uint32_t> left;
      for (const std::uint32_t v : vertices) {
        if (slotOf_[first + v] == kNotCoded) left.push_back(v);
      }
      for (std::size_t phase = 0; phase < kMeshPhases && !left.empty(); ++phase) {
        std::vector<bool> taken(cloth.vertexCount);
        const bool last = phase + 1 == kMeshPhases;
        const std::vector<std::uint32_t> apart = last ? left : takeApart(graph, left, taken);
        addPhase(apart, weightClass + (phase == 0 ? 0 : 1), graph, search);
        std::erase_if(left, [&](std::uint32_t v) { return taken[v]; });
      }
    }
    for (std::uint32_t v = 0; v < cloth.vertexCount; ++v) setNearest(v, levels[0].graph.of(v));
  }

  bool finish() {
    if (!hierarchy_.phases.allocate(phaseCount_)) return false;
    std::copy_n(phases_.data(), phaseCount_, hierarchy_.phases.data());
    return true;
  }

 private:
  // A few, each from those before it; or many that have no neighbours left, from nothing.
  void addCoarsest(std::span<const std::uint32_t> vertices) {
    const bool few = vertices.size() <= kFewVertices;
    std::vector<std::uint32_t> known;
    Neighbours neighbours;
    openPhase(kWeightClasses);
    for (const std::uint32_t v : vertices) {
      if (few) openPhase(kWeightClasses);
      setParents(neighbours,
                 std::span<const std::uint32_t>(known).first(std::min<std::size_t>(known.size(), 4)));
      setRing(neighbours, known);
      if (few) known.push_back(next_);
      code(first_ + v, neighbours);
    }
  }

  void addPhase(std::span<const std::uint32_t> vertices, std::uint32_t weightClass, const Graph& graph,
                Search& search) {
    openPhase(weightClass);
    const std::uint32_t begin = next_;
    for (const std::uint32_t v : vertices) {
      const auto found = search.find(graph, v, kMaxVisited,
                                     [&](std::uint32_t other) { return slotOf_[first_ + other] < begin; });
      std::array<std::uint32_t, kMaxFound> known;
      for (std::size_t i = 0; i < found.size(); ++i) known[i] = slotOf_[first_ + found[i]];
      const auto direct = graph.of(v);
      std::size_t near = 0;
      while (near < found.size() && std::find(direct.begin(), direct.end(), found[near]) != direct.end())
        ++near;
      Neighbours neighbours;
      std::size_t parents = near;
      if (near >= 4) {
        // Two pairs, each across from one side to the other; they go to the front.
        const std::size_t half = near / 2, quarter = near / 4;
        const std::array<std::uint32_t, 4> pairs{known[0], known[half], known[quarter],
                                                 known[quarter + half]};
        const auto isPair = [&](std::uint32_t slot) {
          return std::find(pairs.begin(), pairs.end(), slot) != pairs.end();
        };
        std::stable_partition(known.begin(), known.begin() + static_cast<std::ptrdiff_t>(found.size()),
                              isPair);
        std::copy(pairs.begin(), pairs.end(), known.begin());
        parents = 4;
      } else if (near < 2) {
        parents = std::min<std::size_t>(found.size(), 4);
      }
      const std::span<const std::uint32_t> all = std::span<const std::uint32_t>(known).first(found.size());
      setParents(neighbours, all.first(parents));
      setRing(neighbours, all.subspan(parents));
      code(first_ + v, neighbours);
    }
  }

  // Four of them, spread over all.
  void setNearest(std::uint32_t vertex, std::span<const std::uint32_t> others) {
    const std::uint32_t slot = slotOf_[first_ + vertex];
    for (std::size_t i = 0; i < 4; ++i) {
      const bool few = others.size() < 4;
      const std::size_t choice = few ? i : i * others.size() / 4;
      hierarchy_.nearest[slot][i] = choice < others.size() ? slotOf_[first_ + others[choice]] : slot;
    }
  }

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
        hierarchy_.nearest[slot] = {at(column - 1, row), at(column + 1, row), at(column, row - 1),
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
  // Of a grid four corners, and two a level; of a mesh more of the first, fewer of the others.
  constexpr std::size_t kMaxPhasesPerCloth = 4 + 2 * 32 + 80;
  static_assert(kMaxPhasesPerCloth >= kFewVertices + kMeshPhases * kMaxMeshLevels);
  Builder builder(*this, layout.vertexCount());
  if (!builder.allocate(kMaxPhasesPerCloth * layout.cloths.size() + 1)) return false;
  std::uint32_t first = 0;
  for (const ClothLayout& cloth : layout.cloths) {
    if (!cloth.triangles.empty()) {
      builder.addMesh(first, cloth);
    } else {
      const bool grid = cloth.rows > 0;
      builder.addGrid(first, grid ? cloth.rows : 1, grid ? cloth.columns : cloth.vertexCount);
    }
    first += cloth.vertexCount;
  }
  return builder.finish();
}

}  // namespace clothstream::codec::hierarchical
