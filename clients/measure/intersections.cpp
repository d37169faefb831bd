// SPDX-License-Identifier: MIT
// Tests edges against triangles that a tree of boxes finds.
#include "clients/measure/intersections.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace clothstream::measure {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;

// Six times the volume of a tetrahedron: its sign says on which side of the triangle abc d lies.
double side(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Point u = minus(b, a), v = minus(c, a), w = minus(d, a);
  return (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] +
         (u[0] * v[1] - u[1] * v[0]) * w[2];
}

bool pierces(const Point& p, const Point& q, const Point& a, const Point& b, const Point& c) {
  if (!(side(a, b, c, p) * side(a, b, c, q) < 0)) return false;
  const double u = side(p, q, a, b), v = side(p, q, b, c), w = side(p, q, c, a);
  return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

void grow(Point& low, Point& high, const Point& point) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::min(low[axis], point[axis]);
    high[axis] = std::max(high[axis], point[axis]);
  }
}

}  // namespace

Intersections::Intersections(std::span<const Triangle> triangles)
    : triangles_(triangles.begin(), triangles.end()), boxes_(triangles.size()), order_(triangles.size()) {
  for (const Triangle& triangle : triangles_)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [a, b] = std::minmax({triangle[i], triangle[(i + 1) % 3]});
      edges_.push_back({a, b});
    }
  std::ranges::sort(edges_);
  edges_.erase(std::ranges::unique(edges_).begin(), edges_.end());
}

// Divides the triangles at the median of their middles along the longest axis of the box.
void Intersections::build(std::uint32_t first, std::uint32_t end) {
  const std::size_t place = nodes_.size();
  Node& node = nodes_.emplace_back(Node{boxes_[order_[first]], first, end});
  for (std::uint32_t i = first + 1; i < end; ++i) {
    grow(node.box.low, node.box.high, boxes_[order_[i]].low);
    grow(node.box.low, node.box.high, boxes_[order_[i]].high);
  }
  if (end - first <= kLeafTriangles) return;
  const Point size = minus(node.box.high, node.box.low);
  const auto axis = static_cast<std::size_t>(std::ranges::max_element(size) - size.begin());
  const auto middle = [&](std::uint32_t triangle) {
    return boxes_[triangle].low[axis] + boxes_[triangle].high[axis];
  };
  const std::uint32_t half = first + (end - first) / 2;
  std::ranges::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + end,
                           [&](std::uint32_t a, std::uint32_t b) { return middle(a) < middle(b); });
  build(first, half);
  nodes_[place].right = static_cast<std::uint32_t>(nodes_.size());
  build(half, end);
}

std::size_t Intersections::countOf(std::uint32_t a, std::uint32_t b, std::span<const float> positions) const {
  const Point p = pointAt(positions, a), q = pointAt(positions, b);
  Box box{p, p};
  grow(box.low, box.high, q);
  const auto misses = [&](const Box& other) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!(box.high[axis] >= other.low[axis] && box.low[axis] <= other.high[axis])) return true;
    return false;
  };
  std::size_t count = 0;
  std::array<std::uint32_t, 64> waiting{};  // the depth of the tree is at most 32
  std::size_t left = nodes_.empty() ? 0 : 1;
  while (left > 0) {
    const std::uint32_t place = waiting[--left];
    const Node& node = nodes_[place];
    if (misses(node.box)) continue;
    if (node.right != 0) {
      waiting[left++] = node.right;
      waiting[left++] = place + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.end; ++i) {
      const Triangle& triangle = triangles_[order_[i]];
      if (misses(boxes_[order_[i]])) continue;
      if (std::ranges::find(triangle, a) != triangle.end() ||
          std::ranges::find(triangle, b) != triangle.end())
        continue;
      count += pierces(p, q, pointAt(positions, triangle[0]), pointAt(positions, triangle[1]),
                       pointAt(positions, triangle[2]))
                   ? 1
                   : 0;
    }
  }
  return count;
}

std::vector<std::size_t> Intersections::count(std::span<const float> positions,
                                              std::span<const Range> ranges) {
  order_.clear();
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
    const Point corner = pointAt(positions, triangles_[i][0]);
    boxes_[i] = {corner, corner};
    grow(boxes_[i].low, boxes_[i].high, pointAt(positions, triangles_[i][1]));
    grow(boxes_[i].low, boxes_[i].high, pointAt(positions, triangles_[i][2]));
    const bool finite = std::ranges::all_of(triangles_[i], [&](std::uint32_t vertex) {
      const Point point = pointAt(positions, vertex);
      return std::isfinite(point[0]) && std::isfinite(point[1]) && std::isfinite(point[2]);
    });
    if (finite) order_.push_back(i);
  }
  nodes_.clear();
  if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()));
  std::vector<std::size_t> counts(ranges.size(), 0);
  for (const auto& [a, b] : edges_)
    for (std::size_t i = 0; i < ranges.size(); ++i)
      if (a >= ranges[i].first && a < ranges[i].end) counts[i] += countOf(a, b, positions);
  return counts;
}

}  // namespace clothstream::measure
