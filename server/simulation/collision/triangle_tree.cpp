// SPDX-License-Identifier: MIT
#include "server/simulation/collision/triangle_tree.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <tuple>

namespace clothstream::simulation {
namespace {

using Box = TriangleTree::Box;

Box emptyBox() {
  const float far = std::numeric_limits<float>::max();
  return {model::Vec3::Constant(far), model::Vec3::Constant(-far)};
}

void include(Box& box, const model::Vec3& point) {
  box.low = box.low.cwiseMin(point);
  box.high = box.high.cwiseMax(point);
}

class Builder {
 public:
  Builder(std::span<const model::Vec3> vertices, std::span<const model::TriangleCorners> triangles)
      : vertices_(vertices), triangles_(triangles) {
    const std::size_t count = triangles.size();
    tree_.leafCount =
        static_cast<std::uint32_t>(std::bit_ceil((count + kLeafTriangles - 1) / kLeafTriangles));
    tree_.order.resize(count);
    std::iota(tree_.order.begin(), tree_.order.end(), 0u);
    for (const model::TriangleCorners& triangle : triangles)
      centres_.push_back(vertices[triangle[0]] + vertices[triangle[1]] + vertices[triangle[2]]);
    tree_.boxes.assign(2 * std::size_t{tree_.leafCount}, emptyBox());
  }

  TriangleTree build() && {
    divide(0, tree_.leafCount);
    for (std::size_t leaf = 0; leaf < tree_.leafCount; ++leaf)
      for (std::size_t i = tree_.firstOf(leaf); i < tree_.firstOf(leaf + 1); ++i)
        for (const std::uint32_t corner : triangles_[tree_.order[i]])
          include(tree_.boxes[tree_.leafCount + leaf], vertices_[corner]);
    for (std::size_t node = tree_.leafCount - 1; node > 0; --node)
      for (const std::size_t child : {2 * node, 2 * node + 1}) {
        include(tree_.boxes[node], tree_.boxes[child].low);
        include(tree_.boxes[node], tree_.boxes[child].high);
      }
    return std::move(tree_);
  }

 private:
  // Orders the triangles of the leaves from `first` to before `end`.
  void divide(std::size_t first, std::size_t end) {
    if (end - first < 2) return;
    const std::size_t middle = (first + end) / 2;
    const auto at = [&](std::size_t leaf) {
      return tree_.order.begin() + static_cast<std::ptrdiff_t>(tree_.firstOf(leaf));
    };
    Box box = emptyBox();
    for (auto triangle = at(first); triangle != at(end); ++triangle) include(box, centres_[*triangle]);
    Eigen::Index axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    std::nth_element(at(first), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      return std::tuple(centres_[a][axis], a) < std::tuple(centres_[b][axis], b);
    });
    // nth_element leaves the order of the parts to the library.
    std::sort(at(first), at(middle));
    std::sort(at(middle), at(end));
    divide(first, middle);
    divide(middle, end);
  }

  std::span<const model::Vec3> vertices_;
  std::span<const model::TriangleCorners> triangles_;
  std::vector<model::Vec3> centres_;  // times three
  TriangleTree tree_;
};

}  // namespace

TriangleTree makeTriangleTree(std::span<const model::Vec3> vertices,
                              std::span<const model::TriangleCorners> triangles) {
  return Builder(vertices, triangles).build();
}

}  // namespace clothstream::simulation
