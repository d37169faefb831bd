// SPDX-License-Identifier: MIT
// Counts the places where a cloth passes through itself or through another cloth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/measure/surface.h"

namespace clothstream::measure {

// Finds pairs of an edge and a triangle that it pierces. Pairs with a common vertex do not count.
class Intersections {
 public:
  explicit Intersections(std::span<const Triangle> triangles);

  // Number of piercing edges between the vertices `first` to `end` - 1, each counted once for every triangle
  // that it pierces. All triangles take part. Positions have 3 floats per vertex; an edge or triangle with a
  // position that is not finite pierces nothing.
  struct Range {
    std::uint32_t first = 0, end = UINT32_MAX;
  };
  std::vector<std::size_t> count(std::span<const float> positions, std::span<const Range> ranges);

 private:
  struct Box {
    Point low, high;
  };
  // Node of a binary tree of boxes. A leaf has the triangles `first` to `end` - 1 of `order_`; the children
  // of another node follow it: the left one directly, the right one at `right`.
  struct Node {
    Box box;
    std::uint32_t first = 0, end = 0, right = 0;
  };

  void build(std::uint32_t first, std::uint32_t end);
  std::size_t countOf(std::uint32_t a, std::uint32_t b, std::span<const float> positions) const;

  std::vector<Triangle> triangles_;
  std::vector<std::array<std::uint32_t, 2>> edges_;  // each once, ascending
  std::vector<Box> boxes_;                           // of the triangles
  std::vector<std::uint32_t> order_;                 // triangles as the leaves have them
  std::vector<Node> nodes_;
};

}  // namespace clothstream::measure
