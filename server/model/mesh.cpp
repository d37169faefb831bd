// SPDX-License-Identifier: MIT
// Springs, areas and mass shares of a triangle mesh.
#include "server/model/mesh.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <tuple>
#include <utility>

#include "server/model/gas.h"

namespace clothstream::model {
namespace {

constexpr std::uint32_t kNone = ~0u;

// Side of a triangle.
struct Side {
  std::uint32_t low, high;  // end nodes, low < high
  std::uint32_t triangle;
  std::uint32_t apex;  // third corner of the triangle
};

std::vector<Side> sidesOf(const std::vector<Triangle>& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax(triangles[t][i], triangles[t][(i + 1) % 3]);
      sides.push_back({low, high, t, triangles[t][(i + 2) % 3]});
    }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.low, s.high, s.triangle); });
  return sides;
}

template <typename Visit>
void forEachEdge(const std::vector<Side>& sides, Visit&& visit) {
  for (std::size_t i = 0; i < sides.size();) {
    const bool shared =
        i + 1 < sides.size() && sides[i].low == sides[i + 1].low && sides[i].high == sides[i + 1].high;
    visit(sides[i], shared ? &sides[i + 1] : nullptr);
    i += shared ? 2 : 1;
  }
}

// Corners of a quad relative to one of its halves.
struct Half {
  std::uint32_t diagonal[2] = {kNone, kNone};
  std::uint32_t otherApex = kNone;
};

class LinkFinder {
 public:
  explicit LinkFinder(const MeshShape& shape)
      : shape_(shape), partner_(shape.triangles.size(), kNone), halves_(shape.triangles.size()) {
    for (const std::uint32_t t : shape.quads) {
      partner_[t] = t + 1;
      partner_[t + 1] = t;
    }
  }

  std::vector<SpringLink> find(const std::vector<Side>& sides, const Cancellation& cancellation) {
    forEachEdge(sides, [&](const Side& first, const Side* second) {
      if (second != nullptr && partner_[first.triangle] == second->triangle) addDiagonals(first, *second);
    });
    forEachEdge(sides, [&](const Side& first, const Side* second) {
      if (second != nullptr && partner_[first.triangle] == second->triangle) return;
      add(first.low, first.high, SpringKind::structural);
      if (second == nullptr) return;
      add(across(first, first.low), across(*second, first.low), SpringKind::bend);
      add(across(first, first.high), across(*second, first.high), SpringKind::bend);
    });
    cancellation.check();
    return ordered();
  }

 private:
  void add(std::uint32_t a, std::uint32_t b, SpringKind kind) {
    if (a == b) return;
    const float length = (shape_.positions[a] - shape_.positions[b]).norm();
    links_.push_back({std::min(a, b), std::max(a, b), kind, length});
  }

  void addDiagonals(const Side& first, const Side& second) {
    add(first.low, first.high, SpringKind::shear);
    add(first.apex, second.apex, SpringKind::shear);
    halves_[first.triangle] = {{first.low, first.high}, second.apex};
    halves_[second.triangle] = {{first.low, first.high}, first.apex};
  }

  // Node that a bend spring across `side` joins: the apex of a triangle, or the other neighbour of `end` in a
  // quad.
  std::uint32_t across(const Side& side, std::uint32_t end) const {
    const Half& half = halves_[side.triangle];
    if (half.otherApex == kNone) return side.apex;
    if (end == half.diagonal[0] || end == half.diagonal[1]) return half.otherApex;
    // The side connects the apex of this half to one end of the diagonal, so the corner is the other end.
    const std::uint32_t taken = side.low == end ? side.high : side.low;
    return half.diagonal[taken == half.diagonal[0] ? 1 : 0];
  }

  std::vector<SpringLink> ordered() {
    std::ranges::sort(links_, {}, [](const SpringLink& l) { return std::tuple(l.a, l.b, l.kind); });
    links_.erase(
        std::unique(links_.begin(), links_.end(),
                    [](const SpringLink& x, const SpringLink& y) { return x.a == y.a && x.b == y.b; }),
        links_.end());
    std::ranges::sort(links_, {}, [](const SpringLink& l) { return std::tuple(l.a, l.kind, l.b); });
    return std::move(links_);
  }

  const MeshShape& shape_;
  std::vector<std::uint32_t> partner_;  // other half of the quad, for a triangle that is half of one
  std::vector<Half> halves_;
  std::vector<SpringLink> links_;
};

// Number of parts without a common node.
std::uint32_t piecesOf(const MeshShape& shape) {
  std::vector<std::uint32_t> parents(shape.positions.size());
  std::iota(parents.begin(), parents.end(), 0u);
  const auto rootOf = [&](std::uint32_t node) {
    while (parents[node] != node) node = parents[node] = parents[parents[node]];
    return node;
  };
  auto pieces = static_cast<std::uint32_t>(parents.size());
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    a = rootOf(a), b = rootOf(b);
    if (a == b) return;
    parents[std::max(a, b)] = std::min(a, b);
    --pieces;
  };
  for (const auto& [a, b, c] : shape.triangles) {
    join(a, b);
    join(b, c);
  }
  return pieces;
}

// Sets what the mesh encloses.
void close(const std::vector<Side>& sides, Mesh& mesh) {
  forEachEdge(sides, [&](const Side& first, const Side* second) {
    if (second == nullptr && !mesh.openEdge) mesh.openEdge = {first.low, first.high};
  });
  if (mesh.openEdge || sides.empty()) return;
  mesh.pieces = piecesOf(mesh.shape);
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(mesh.shape.positions.size());
  for (const Vec3& position : mesh.shape.positions) positions.push_back(position.cast<double>());
  mesh.volume = enclosedVolume(mesh.shape.triangles, positions);
}

std::vector<double> lumpedAreas(const MeshShape& shape) {
  std::vector<double> areas(shape.positions.size(), 0);
  for (const Triangle& triangle : shape.triangles) {
    const auto at = [&](std::size_t i) { return shape.positions[triangle[i]].cast<double>().eval(); };
    const double area = 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
    for (const std::uint32_t node : triangle) areas[node] += area / 3;
  }
  return areas;
}

}  // namespace

Mesh makeMesh(MeshShape shape, const Cancellation& cancellation) {
  Mesh mesh;
  mesh.shape = std::move(shape);
  mesh.areas = lumpedAreas(mesh.shape);
  mesh.area = std::accumulate(mesh.areas.begin(), mesh.areas.end(), 0.0);
  if (!mesh.shape.positions.empty()) mesh.low = mesh.high = mesh.shape.positions[0];
  for (const Vec3& position : mesh.shape.positions) {
    mesh.low = mesh.low.cwiseMin(position);
    mesh.high = mesh.high.cwiseMax(position);
  }
  cancellation.check();
  const std::vector<Side> sides = sidesOf(mesh.shape.triangles);
  cancellation.check();
  mesh.links = LinkFinder(mesh.shape).find(sides, cancellation);
  close(sides, mesh);
  for (const double area : mesh.areas) mesh.shares.push_back(area / mesh.area);
  return mesh;
}

std::vector<Triangle> clothTriangles(const Cloth& cloth) {
  if (cloth.mesh) return cloth.mesh->shape.triangles;
  std::vector<Triangle> triangles(triangleCount(cloth));
  for (std::uint32_t i = 0; i < triangles.size(); ++i) triangles[i] = triangleAt(cloth, i);
  return triangles;
}

std::uint32_t triangleCount(const Cloth& cloth) {
  if (cloth.mesh) return static_cast<std::uint32_t>(cloth.mesh->shape.triangles.size());
  return 2 * (cloth.grid.rows - 1) * (cloth.grid.columns - 1);
}

Triangle triangleAt(const Cloth& cloth, std::uint32_t index) {
  if (cloth.mesh) return cloth.mesh->shape.triangles[index];
  const std::uint32_t columns = cloth.grid.columns, quad = index / 2;
  const std::uint32_t a = quad / (columns - 1) * columns + quad % (columns - 1), b = a + 1;
  const std::uint32_t e = a + columns, f = e + 1;
  return index % 2 == 0 ? Triangle{a, e, b} : Triangle{b, e, f};
}

}  // namespace clothstream::model
