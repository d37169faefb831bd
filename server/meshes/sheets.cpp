// SPDX-License-Identifier: MIT
#include "server/meshes/sheets.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

namespace clothstream::meshes {
namespace {

using model::Triangle;
using model::Vec3;

constexpr std::uint32_t kNone = ~0u;
// Attempts to keep two neighbours at edges with more than two triangles. After these, all of them become
// separate.
constexpr int kAttempts = 4;

// Side i of a triangle goes from its corner i to the next one. Its number, and that of its first corner, is
// 3 * triangle + i.
constexpr std::uint32_t nextCorner(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

struct Side {
  std::uint32_t low, high, number;
  bool upwards;
};

// Sides, ordered by their nodes. `nodeOf` returns the node of a corner, `isTurned` whether a triangle is
// turned.
template <typename NodeOf, typename IsTurned>
std::vector<Side> sortedSides(std::uint32_t triangles, const NodeOf& nodeOf, const IsTurned& isTurned) {
  std::vector<Side> sides;
  sides.reserve(std::size_t{3} * triangles);
  for (std::uint32_t i = 0; i < 3 * triangles; ++i) {
    const std::uint32_t a = nodeOf(i), b = nodeOf(nextCorner(i));
    sides.push_back({std::min(a, b), std::max(a, b), i, (a < b) != isTurned(i / 3)});
  }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.low, s.high, s.number); });
  return sides;
}

// Calls handle(span of sides) for each edge.
template <typename Handle>
void forEachEdge(const std::vector<Side>& sides, const Handle& handle) {
  for (std::size_t first = 0, end = 0; first < sides.size(); first = end) {
    while (end < sides.size() && sides[end].low == sides[first].low && sides[end].high == sides[first].high)
      ++end;
    handle(std::span(sides).subspan(first, end - first));
  }
}

class Separation {
 public:
  Separation(const std::vector<SheetTriangle>& triangles, const std::vector<Vec3>& placed,
             const model::Cancellation& cancellation)
      : triangles_(triangles),
        placed_(placed),
        cancellation_(cancellation),
        count_(static_cast<std::uint32_t>(triangles.size())),
        sides_(sortedSides(
            count_, [&](std::uint32_t i) { return nodeOf(i); }, [](std::uint32_t) { return false; })),
        isSplit_(sides_.size(), false) {}

  // Returns false if there would be more than `maxNodes` nodes.
  bool run(std::uint64_t maxNodes) {
    for (int attempt = 0;; ++attempt) {
      const bool hasPairs = join(attempt < kAttempts);
      cancellation_.check();
      orient();
      cancellation_.check();
      if (!copyNodes(maxNodes)) return false;
      cancellation_.check();
      // Without pairs, the triangles of a fan have a split edge only at its two ends, so every edge has at
      // most two.
      if (!hasPairs || isManifold()) return true;
    }
  }

  // Node of each corner after run(); those from placed.size() on are copies.
  const std::vector<std::uint32_t>& nodes() const { return nodes_; }
  // Node of which each copy is one.
  const std::vector<std::uint32_t>& copied() const { return copied_; }
  bool isTurned(std::uint32_t triangle) const { return turned_[triangle] != 0; }

  void addTo(Repairs& repairs) const {
    forEachEdge(sides_, [&](std::span<const Side> edge) { repairs.splitEdges += edge.size() > 2 ? 1 : 0; });
    repairs.cutEdges += cutEdges_;
    repairs.turnedTriangles += static_cast<std::uint32_t>(std::ranges::count(turned_, 1));
    std::vector<std::uint32_t> split = copied_;
    std::ranges::sort(split);
    repairs.addedVertices += static_cast<std::uint32_t>(split.size());
    repairs.splitVertices += static_cast<std::uint32_t>(std::ranges::unique(split).begin() - split.begin());
  }

 private:
  std::uint32_t nodeOf(std::uint32_t corner) const { return triangles_[corner / 3].nodes[corner % 3]; }

  // Finds the neighbour of each side. Returns whether an edge with more than two triangles has kept two of
  // them.
  bool join(bool keepPairs) {
    bool hasPairs = false;
    neighbours_.assign(sides_.size(), kNone);
    forEachEdge(sides_, [&](std::span<const Side> edge) {
      if (edge.size() < 2) return;
      std::pair pair(edge[0].number, edge[1].number);
      if (edge.size() > 2) {
        if (!keepPairs || std::ranges::any_of(edge, [&](const Side& s) { return isSplit_[s.number]; }))
          return;
        pair = smoothest(edge);
        hasPairs = true;
      }
      neighbours_[pair.first] = pair.second;
      neighbours_[pair.second] = pair.first;
    });
    return hasPairs;
  }

  // Two sides of an edge to keep: the halves of a quad, or else the first side and the one whose triangle
  // continues it most smoothly.
  std::pair<std::uint32_t, std::uint32_t> smoothest(std::span<const Side> edge) const {
    for (std::size_t i = 1; i < edge.size(); ++i) {
      const std::uint32_t t = edge[i - 1].number / 3;
      if (triangles_[t].isFirstHalf && edge[i].number / 3 == t + 1)
        return {edge[i - 1].number, edge[i].number};
    }
    const Eigen::Vector3d first = across(edge[0]);
    std::size_t best = 1;
    double least = 2;
    for (std::size_t i = 1; i < edge.size(); ++i)
      if (const double cosine = first.dot(across(edge[i])); cosine < least) best = i, least = cosine;
    return {edge[0].number, edge[best].number};
  }

  // Direction from the edge into the triangle.
  Eigen::Vector3d across(const Side& side) const {
    const Eigen::Vector3d a = placed_[side.low].cast<double>();
    const Eigen::Vector3d along = (placed_[side.high].cast<double>() - a).normalized();
    const Eigen::Vector3d to = placed_[nodeOf(nextCorner(nextCorner(side.number)))].cast<double>() - a;
    return (to - along * along.dot(to)).normalized();
  }

  // Whether two neighbours have their fronts on one side: they run along their edge in opposite directions.
  bool agree(std::uint32_t side, std::uint32_t other) const {
    return nodeOf(side) == nodeOf(nextCorner(other));
  }

  // Turns triangles, piece by piece, and separates neighbours that cannot agree. A closed piece gets its
  // fronts outside, and another one as few turned triangles as possible.
  void orient() {
    cutEdges_ = 0;
    turned_.assign(count_, 0);
    std::vector<bool> isReached(count_, false);
    std::vector<std::uint32_t> piece;
    for (std::uint32_t seed = 0; seed < count_; ++seed) {
      if (isReached[seed]) continue;
      piece.assign(1, seed);
      isReached[seed] = true;
      std::size_t turns = 0;
      for (std::size_t at = 0; at < piece.size(); ++at)
        for (std::uint32_t side = 3 * piece[at]; side < 3 * piece[at] + 3; ++side) {
          const std::uint32_t other = neighbours_[side];
          if (other == kNone) continue;
          const auto wanted = static_cast<std::uint8_t>(turned_[side / 3] ^ (agree(side, other) ? 0 : 1));
          if (!isReached[other / 3]) {
            isReached[other / 3] = true;
            turned_[other / 3] = wanted;
            turns += wanted;
            piece.push_back(other / 3);
          } else if (turned_[other / 3] != wanted) {
            neighbours_[side] = neighbours_[other] = kNone;
            ++cutEdges_;
          }
        }
      if (isClosed(piece) ? isInsideOut(piece) : 2 * turns > piece.size())
        for (const std::uint32_t triangle : piece) turned_[triangle] ^= 1;
    }
  }

  bool isClosed(std::span<const std::uint32_t> piece) const {
    return std::ranges::all_of(piece, [&](std::uint32_t triangle) {
      return std::ranges::none_of(std::span(neighbours_).subspan(3 * std::size_t{triangle}, 3),
                                  [](std::uint32_t other) { return other == kNone; });
    });
  }

  // Whether the volume of a closed piece is negative. Places are relative to its first corner.
  bool isInsideOut(std::span<const std::uint32_t> piece) const {
    const auto at = [&](std::uint32_t corner) { return placed_[nodeOf(corner)].cast<double>().eval(); };
    const Eigen::Vector3d first = at(3 * piece[0]);
    double volume = 0;
    for (const std::uint32_t triangle : piece) {
      const std::uint32_t corner = 3 * triangle;
      const double part = (at(corner) - first).dot((at(corner + 1) - first).cross(at(corner + 2) - first));
      volume += turned_[triangle] != 0 ? -part : part;
    }
    return volume < 0;
  }

  // Gives each fan of neighbouring triangles around a node its own copy; the first fan keeps the node.
  bool copyNodes(std::uint64_t maxNodes) {
    std::vector<std::uint32_t> fans(sides_.size());
    std::iota(fans.begin(), fans.end(), 0u);
    const auto fanOf = [&](std::uint32_t corner) {
      while (fans[corner] != corner) corner = fans[corner] = fans[fans[corner]];
      return corner;
    };
    const auto unite = [&](std::uint32_t a, std::uint32_t b) {
      a = fanOf(a), b = fanOf(b);
      fans[std::max(a, b)] = std::min(a, b);
    };
    for (std::uint32_t side = 0; side < neighbours_.size(); ++side) {
      const std::uint32_t other = neighbours_[side];
      if (other == kNone || other < side) continue;
      const bool same = nodeOf(side) == nodeOf(other);
      unite(side, same ? other : nextCorner(other));
      unite(nextCorner(side), same ? nextCorner(other) : other);
    }
    std::vector<bool> isTaken(placed_.size(), false);
    std::uint64_t nodeCount = 0;
    copied_.clear();
    nodes_.assign(sides_.size(), kNone);
    for (std::uint32_t corner = 0; corner < nodes_.size(); ++corner) {
      const std::uint32_t fan = fanOf(corner), node = nodeOf(corner);  // the fan is the lowest of its corners
      if (fan == corner) {
        if (++nodeCount > maxNodes) return false;
        nodes_[corner] = isTaken[node] ? static_cast<std::uint32_t>(placed_.size() + copied_.size()) : node;
        if (isTaken[node]) copied_.push_back(node);
        isTaken[node] = true;
      } else {
        nodes_[corner] = nodes_[fan];
      }
    }
    return true;
  }

  // Marks edges as split where a kept pair leaves more than two triangles, or fronts on different sides.
  bool isManifold() {
    bool is = true;
    forEachEdge(sortedSides(
                    count_, [&](std::uint32_t i) { return nodes_[i]; },
                    [&](std::uint32_t triangle) { return turned_[triangle] != 0; }),
                [&](std::span<const Side> edge) {
                  if (edge.size() == 1 || (edge.size() == 2 && edge[0].upwards != edge[1].upwards)) return;
                  is = false;
                  for (const Side& side : edge) isSplit_[side.number] = true;
                });
    return is;
  }

  const std::vector<SheetTriangle>& triangles_;
  const std::vector<Vec3>& placed_;
  const model::Cancellation& cancellation_;
  std::uint32_t count_;
  std::vector<Side> sides_;
  std::vector<bool> isSplit_;                               // sides whose triangles are separate
  std::vector<std::uint32_t> neighbours_, nodes_, copied_;  // of sides, of corners, of copies
  std::vector<std::uint8_t> turned_;
  std::uint32_t cutEdges_ = 0;
};

bool shareAnEdge(const Triangle& a, const Triangle& b) {
  return std::ranges::count_if(a, [&](std::uint32_t node) { return std::ranges::count(b, node) > 0; }) == 2;
}

}  // namespace

bool separateSheets(std::vector<SheetTriangle>& triangles, std::vector<Vec3>& placed,
                    std::vector<std::uint32_t>& origin, std::uint64_t maxNodes,
                    const model::Cancellation& cancellation, Repairs& repairs) {
  Separation separation(triangles, placed, cancellation);
  if (!separation.run(maxNodes)) return false;
  separation.addTo(repairs);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t i = 0; i < 3; ++i) triangles[t].nodes[i] = separation.nodes()[3 * t + i];
    if (!separation.isTurned(t)) continue;
    std::swap(triangles[t].nodes[1], triangles[t].nodes[2]);
    std::swap(triangles[t].uvs[1], triangles[t].uvs[2]);
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (triangles[t].isFirstHalf && !shareAnEdge(triangles[t].nodes, triangles[t + 1].nodes))
      triangles[t].isFirstHalf = false;
  for (const std::uint32_t node : separation.copied()) {
    placed.push_back(Vec3(placed[node]));
    origin.push_back(origin[node]);
  }
  return true;
}

}  // namespace clothstream::meshes
