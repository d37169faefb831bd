// SPDX-License-Identifier: MIT
// Coding order of a mesh. Each level is vertices of the one below that stand apart, about half of them, so
// that at rest a level lies between the vertices of the levels above. Floating point without contraction
// gives the same result on every machine.
#include <cmath>
#include <functional>
#include <queue>
#include <utility>

#include "proto/codec/hierarchical/coding_order.h"

namespace clothstream::codec::hierarchical {
namespace {

// Limits of the searches. They bound the work for any mesh.
constexpr std::size_t kMaxVisited = 64, kMaxOthers = 16, kMaxCandidates = 8, kMaxRingCandidates = 24;
constexpr std::size_t kMaxMeshLevels = 2 * kLevels - 2;
constexpr std::uint32_t kMeshParts = 3;
// Vertices nearer than this factor times the mean distance to the four nearest are not apart.
constexpr double kApart = 1.2;
// Cost of large parent weights, compared with an error at rest.
constexpr double kEven = 0.05;
// Maximum distance of a ring vertex from the point opposite another one, as part of the distance of that
// other one.
constexpr double kOpposite = 0.35;

struct Vector {
  double x, y, z;

  friend Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
};
double dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// Sorted by distance; equal distances by number.
struct Other {
  double distance;
  std::uint32_t vertex;
  friend bool operator<(const Other& a, const Other& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.vertex < b.vertex;
  }
  friend bool operator>(const Other& a, const Other& b) { return b < a; }
};

// Neighbours of the vertices of a level, at most kMaxOthers each.
struct Graph {
  std::span<const Other> of(std::uint32_t vertex) const {
    return std::span(others).subspan(starts[vertex], starts[vertex + 1] - starts[vertex]);
  }
  void add(std::vector<Other>& found) {
    std::sort(found.begin(), found.end());
    if (found.size() > kMaxOthers) found.resize(kMaxOthers);
    others.insert(others.end(), found.begin(), found.end());
  }
  void end() { starts.push_back(others.size()); }

  std::vector<std::size_t> starts{0};  // indexed by vertex, and the end
  std::vector<Other> others;
};

struct Level {
  std::vector<std::uint32_t> vertices;
  Graph graph;
};

class MeshOrder {
 public:
  explicit MeshOrder(const ClothLayout& cloth)
      : count_(cloth.vertexCount), order_(count_), seen_(count_, 0), place_(count_, Vector{}) {
    for (std::size_t v = 0; v < count_ && !cloth.restPositions.empty(); ++v) {
      const float* p = &cloth.restPositions[3 * v];
      place_[v] = {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
    }
    std::vector<Level> levels(1);
    for (std::uint32_t v = 0; v < count_; ++v) levels[0].vertices.push_back(v);
    levels[0].graph = edgesOf(cloth);
    while (levels.size() < kMaxMeshLevels && levels.back().vertices.size() > kMaxCorners) {
      Level coarse = coarserThan(levels.back());
      if (coarse.vertices.size() == levels.back().vertices.size()) break;
      levels.push_back(std::move(coarse));
    }
    known_.assign(count_, false);
    addCoarsest(levels.back().vertices);
    for (std::size_t level = levels.size() - 1; level-- > 0;) addLevel(levels[level], level);
    addNearest(levels);
  }

  CodingOrder take() { return std::move(order_); }

 private:
  double distance(std::uint32_t a, std::uint32_t b) const {
    const Vector d = place_[a] - place_[b];
    return std::sqrt(dot(d, d));
  }

  Graph edgesOf(const ClothLayout& cloth) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    edges.reserve(2 * cloth.triangles.size());
    for (std::size_t i = 0; i < cloth.triangles.size(); i += 3) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t a = cloth.triangles[i + c], b = cloth.triangles[i + (c + 1) % 3];
        if (a == b) continue;
        edges.emplace_back(a, b);
        edges.emplace_back(b, a);
      }
    }
    std::sort(edges.begin(), edges.end());
    onBorder_.assign(count_, false);
    for (auto edge = edges.begin(); edge != edges.end();) {
      const auto next = std::find_if(edge, edges.end(), [&](const auto& other) { return other != *edge; });
      if (next - edge == 1) onBorder_[edge->first] = true;
      edge = next;
    }
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    Graph graph;
    std::vector<Other> found;
    auto edge = edges.begin();
    for (std::uint32_t v = 0; v < count_; ++v) {
      found.clear();
      for (; edge != edges.end() && edge->first == v; ++edge)
        found.push_back({distance(v, edge->second), edge->second});
      graph.add(found);
      graph.end();
    }
    return graph;
  }

  // First wanted vertices around `start`, breadth first.
  template <typename IsWanted>
  std::vector<Other>& search(const Graph& graph, std::uint32_t start, IsWanted&& isWanted) {
    ++search_;
    visited_.assign(1, start);
    seen_[start] = search_;
    found_.clear();
    for (std::size_t next = 0; next < visited_.size(); ++next) {
      for (const Other& other : graph.of(visited_[next])) {
        if (seen_[other.vertex] == search_) continue;
        if (visited_.size() == kMaxVisited) return found_;
        seen_[other.vertex] = search_;
        visited_.push_back(other.vertex);
        if (isWanted(other.vertex)) found_.push_back({distance(start, other.vertex), other.vertex});
      }
    }
    return found_;
  }

  // Orders by path length along edges from the first vertex; continues from the first vertex that was not
  // reached.
  std::vector<std::uint32_t> fromTheFirst(const Level& level) const {
    std::vector<bool> done(count_);
    std::vector<std::uint32_t> order;
    std::priority_queue<Other, std::vector<Other>, std::greater<>> front;
    for (const std::uint32_t start : level.vertices) {
      if (!done[start]) front.push({0, start});
      while (!front.empty()) {
        const Other at = front.top();
        front.pop();
        if (done[at.vertex]) continue;
        done[at.vertex] = true;
        order.push_back(at.vertex);
        for (const Other& other : level.graph.of(at.vertex)) {
          if (!done[other.vertex]) front.push({at.distance + other.distance, other.vertex});
        }
      }
    }
    return order;
  }

  // Takes vertices in this order, except those too near to one that was taken before.
  static std::vector<bool> takeApart(const Graph& graph, std::span<const std::uint32_t> order,
                                     std::size_t count) {
    std::vector<bool> taken(count), excluded(count);
    for (const std::uint32_t v : order) {
      const std::span<const Other> others = graph.of(v);
      const std::size_t four = std::min<std::size_t>(others.size(), 4);
      double sum = 0;
      for (const Other& other : others.first(four)) sum += other.distance;
      const double near = four == 0 ? 0 : kApart * (sum / static_cast<double>(four));
      const auto isTooNear = [&](const Other& o) { return o.distance <= near && taken[o.vertex]; };
      if (excluded[v] || std::any_of(others.begin(), others.end(), isTooNear)) continue;
      taken[v] = true;
      for (const Other& other : others) {
        if (other.distance <= near) excluded[other.vertex] = true;
      }
    }
    return taken;
  }

  Level coarserThan(const Level& fine) {
    std::vector<std::uint32_t> order = fromTheFirst(fine);
    std::stable_partition(order.begin(), order.end(), [&](std::uint32_t v) { return onBorder_[v]; });
    const std::vector<bool> taken = takeApart(fine.graph, order, count_);
    Level coarse;
    for (std::uint32_t v = 0; v < count_; ++v) {
      if (taken[v]) {
        coarse.vertices.push_back(v);
        coarse.graph.add(search(fine.graph, v, [&](std::uint32_t other) { return taken[other]; }));
      }
      coarse.graph.end();
    }
    return coarse;
  }

  // Adds a few vertices, each predicted from those before it; or many without any neighbours, predicted from
  // nothing.
  void addCoarsest(std::span<const std::uint32_t> vertices) {
    const bool few = vertices.size() <= kMaxCorners;
    std::vector<std::uint32_t> before;
    for (const std::uint32_t v : vertices) {
      const std::span<const std::uint32_t> all = before;
      setParents(order_.neighbours[v], all.first(std::min<std::size_t>(all.size(), 4)));
      setRing(order_.neighbours[v], all);
      order_.ranks[v] = rankOfCorner(static_cast<std::uint32_t>(before.size()));
      if (few) before.push_back(v);
    }
    for (const std::uint32_t v : vertices) known_[v] = true;
  }

  void addLevel(const Level& level, std::size_t number) {
    std::vector<std::uint32_t> left;
    for (const std::uint32_t v : fromTheFirst(level)) {
      if (!known_[v]) left.push_back(v);
    }
    for (std::uint32_t part = 0; !left.empty(); ++part) {
      std::vector<std::uint32_t> now;
      if (part + 1 < kMeshParts) {
        const std::vector<bool> taken = takeApart(level.graph, left, count_);
        for (const std::uint32_t v : left) {
          if (taken[v]) now.push_back(v);
        }
      } else {
        now = left;
      }
      for (const std::uint32_t v : now) {
        std::vector<Other>& near = search(level.graph, v, [&](std::uint32_t other) { return known_[other]; });
        std::sort(near.begin(), near.end());
        setNeighbours(v, near);
        order_.ranks[v] = rankOf(static_cast<std::uint32_t>(number / 2), number % 2 != 0, part);
      }
      for (const std::uint32_t v : now) known_[v] = true;
      std::erase_if(left, [&](std::uint32_t v) { return known_[v]; });
    }
  }

  // Chooses two pairs of parents, each across the vertex, if there are four. The rest is the ring.
  void setNeighbours(std::uint32_t v, std::vector<Other>& near) {
    Neighbours& neighbours = order_.neighbours[v];
    std::vector<std::uint32_t> chosen;
    const auto choose = [&](auto&& cost) {
      const auto last = near.begin() + static_cast<std::ptrdiff_t>(std::min(near.size(), kMaxCandidates));
      const auto best = std::min_element(near.begin(), last, [&](const Other& a, const Other& b) {
        return cost(place_[a.vertex] - place_[v]) < cost(place_[b.vertex] - place_[v]);
      });
      chosen.push_back(best->vertex);
      const Vector d = place_[best->vertex] - place_[v];
      near.erase(best);
      return d;
    };
    const auto across = [](const Vector& from) {
      return [from](const Vector& d) {
        const Vector both = from + d;
        return dot(both, both);
      };
    };
    if (near.size() >= 4) {
      const Vector first = choose([](const Vector& d) { return dot(d, d); });
      choose(across(first));
      // Near, and to the side.
      const Vector second = choose([&](const Vector& d) {
        const double along = dot(d, first), squared = dot(d, d);
        const double side = squared * dot(first, first) - along * along;
        return side > 0 ? squared * squared / side : HUGE_VAL;
      });
      choose(across(second));
    } else {
      for (const Other& other : near) chosen.push_back(other.vertex);
      near.clear();
    }
    setParents(neighbours, chosen);
    if (!chosen.empty()) setWeights(v, chosen, neighbours);
    setRing(neighbours, pairsAcross(v, near, neighbours.ring.size()));
  }

  // Takes the nearest vertices that lie roughly opposite each other, so that their mean at rest is near the
  // vertex.
  std::vector<std::uint32_t> pairsAcross(std::uint32_t v, std::vector<Other>& near, std::size_t most) const {
    std::vector<std::uint32_t> pairs;
    if (near.size() > kMaxRingCandidates) near.resize(kMaxRingCandidates);
    while (near.size() > 1 && pairs.size() < most) {
      const Vector first = place_[near.front().vertex] - place_[v];
      const auto off = [&](const Other& other) {
        const Vector both = first + (place_[other.vertex] - place_[v]);
        return dot(both, both);
      };
      const auto best = std::min_element(near.begin() + 1, near.end(),
                                         [&](const Other& a, const Other& b) { return off(a) < off(b); });
      if (off(*best) <= kOpposite * kOpposite * dot(first, first)) {
        pairs.insert(pairs.end(), {near.front().vertex, best->vertex});
        near.erase(best);
      }
      near.erase(near.begin());
    }
    return pairs;
  }

  // Chooses weights that add up to 1, are small, and put the mean at rest as near to the vertex as possible.
  void setWeights(std::uint32_t v, std::span<const std::uint32_t> parents, Neighbours& neighbours) const {
    const std::size_t n = parents.size();
    double m[4][4], x[4];
    double size = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j)
        m[i][j] = dot(place_[parents[i]] - place_[v], place_[parents[j]] - place_[v]);
      size += m[i][i];
      x[i] = 1;
    }
    if (!(size > 0)) return;
    for (std::size_t i = 0; i < n; ++i) m[i][i] += kEven * size / static_cast<double>(n);
    // Gaussian elimination; the matrix is positive definite.
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t i = k + 1; i < n; ++i) {
        const double factor = m[i][k] / m[k][k];
        for (std::size_t j = k; j < n; ++j) m[i][j] -= factor * m[k][j];
        x[i] -= factor * x[k];
      }
    }
    double sum = 0;
    for (std::size_t i = n; i-- > 0;) {
      for (std::size_t j = i + 1; j < n; ++j) x[i] -= m[i][j] * x[j];
      x[i] /= m[i][i];
      sum += x[i];
    }
    constexpr int kWhole = 1 << kParentBits;
    std::array<std::int16_t, 4> weights{};
    int rest = kWhole;
    // Repeated parents (setParents) count only in their first place.
    constexpr std::uint8_t kPlace[5][4] = {{}, {0}, {0, 1}, {0, 1, 3}, {0, 1, 2, 3}};
    for (std::size_t i = 1; i < n; ++i) {
      const double weight = std::clamp(kWhole * (x[i] / sum), -2.0 * kWhole, 2.0 * kWhole);
      const int rounded = static_cast<int>(std::floor(weight + 0.5));
      weights[kPlace[n][i]] = static_cast<std::int16_t>(rounded);
      rest -= rounded;
    }
    weights[0] = static_cast<std::int16_t>(rest);
    neighbours.weights = weights;
  }

  void addNearest(const std::vector<Level>& levels) {
    const std::size_t finestCoarse = std::min<std::size_t>(2 * kCoarseLevel, levels.size() - 1);
    for (std::uint32_t v = 0; v < count_; ++v) {
      const Graph& graph = levels[isCoarse(order_.ranks[v]) ? finestCoarse : 0].graph;
      const std::span<const Other> others = graph.of(v);
      for (std::size_t i = 0; i < 4; ++i) order_.nearest[v][i] = i < others.size() ? others[i].vertex : v;
    }
  }

  std::size_t count_;
  CodingOrder order_;
  std::vector<std::uint32_t> seen_;  // indexed by vertex: the last search that visited it
  std::uint32_t search_ = 0;
  std::vector<std::uint32_t> visited_;
  std::vector<Other> found_;
  std::vector<Vector> place_;   // rest positions; all at the origin if unknown
  std::vector<bool> onBorder_;  // ends of edges that belong to only one triangle
  std::vector<bool> known_;
};

}  // namespace

CodingOrder orderMesh(const ClothLayout& cloth) {
  return MeshOrder(cloth).take();
}

}  // namespace clothstream::codec::hierarchical
