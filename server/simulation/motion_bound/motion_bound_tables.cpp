// SPDX-License-Identifier: MIT
// Nodes, edges and triangles of the cloths that nothing passes through, and a tree of boxes over the
// triangles.
#include "server/simulation/motion_bound/motion_bound_tables.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

#include "server/model/mesh.h"
#include "server/simulation/scene_tables.h"

namespace clothstream::simulation {
namespace {

// Children of a box.
constexpr std::uint32_t kWidth = 8;

// Builds the tree in the order of a depth-first search.
class Tree {
 public:
  Tree(MotionBoundTables& tables, std::span<const model::Vec3> middles) : tables_(tables), middles_(middles) {
    order_.resize(middles.size());
    std::iota(order_.begin(), order_.end(), 0u);
  }

  void build() {
    add(order_);
    tables_.boxCount = boxes_;
    for (const std::vector<shared::BranchRecord>& level : levels_) {
      tables_.levels.push_back(static_cast<std::uint32_t>(tables_.branches.size()));
      tables_.branches.insert(tables_.branches.end(), level.begin(), level.end());
    }
    tables_.levels.push_back(static_cast<std::uint32_t>(tables_.branches.size()));
  }

 private:
  // Returns the height of the subtree; 0 for a leaf.
  std::size_t add(std::span<std::uint32_t> faces) {
    const std::uint32_t box = boxes_++;
    if (faces.size() == 1) {
      tables_.faces[faces[0]].box = static_cast<float>(box);
      return 0;
    }
    std::size_t height = 0;
    for (const std::span<std::uint32_t> child : divided(faces, kWidth)) height = std::max(height, add(child));
    if (levels_.size() <= height) levels_.resize(height + 1);
    levels_[height].push_back({static_cast<float>(box), static_cast<float>(boxes_), 0, 0});
    return height + 1;
  }

  // Up to `width` parts, a power of two.
  std::vector<std::span<std::uint32_t>> divided(std::span<std::uint32_t> faces, std::uint32_t width) {
    if (width == 1 || faces.size() == 1) return {faces};
    model::Vec3 low = middles_[faces[0]], high = low;
    for (const std::uint32_t face : faces) {
      low = low.cwiseMin(middles_[face]);
      high = high.cwiseMax(middles_[face]);
    }
    Eigen::Index axis = 0;
    (high - low).maxCoeff(&axis);
    const auto half = static_cast<std::ptrdiff_t>(faces.size() / 2);
    std::nth_element(faces.begin(), faces.begin() + half, faces.end(), [&](std::uint32_t a, std::uint32_t b) {
      const float atA = middles_[a][axis], atB = middles_[b][axis];
      return atA != atB ? atA < atB : a < b;
    });
    std::vector<std::span<std::uint32_t>> parts =
        divided(faces.first(static_cast<std::size_t>(half)), width / 2);
    for (const auto& part : divided(faces.subspan(static_cast<std::size_t>(half)), width / 2))
      parts.push_back(part);
    return parts;
  }

  MotionBoundTables& tables_;
  std::span<const model::Vec3> middles_;
  std::vector<std::uint32_t> order_;
  std::vector<std::vector<shared::BranchRecord>> levels_;
  std::uint32_t boxes_ = 0;
};

}  // namespace

MotionBoundTables motionBoundTables(std::span<const model::Cloth> cloths) {
  MotionBoundTables tables;
  const NodeState rest = restState(cloths);
  const std::vector<std::uint32_t> offsets = clothOffsets(cloths);
  std::vector<model::Triangle> triangles;
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    if (!model::boundsMotion(cloths[i])) continue;
    for (std::uint32_t node = offsets[i]; node < offsets[i + 1]; ++node)
      tables.parts.push_back({static_cast<float>(node), static_cast<float>(node), 0, 0});
    for (const model::Triangle& triangle : model::clothTriangles(cloths[i]))
      triangles.push_back({offsets[i] + triangle[0], offsets[i] + triangle[1], offsets[i] + triangle[2]});
  }
  tables.nodeCount = static_cast<std::uint32_t>(tables.parts.size());

  std::unordered_map<std::uint64_t, std::uint32_t> edges;
  std::vector<bool> seen(offsets.back());
  std::vector<model::Vec3> middles;
  for (const model::Triangle& triangle : triangles) {
    std::array<float, 3> owned{-1, -1, -1};
    std::uint32_t corners = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!seen[triangle[k]]) corners |= 1u << k;
      seen[triangle[k]] = true;
      const auto [a, b] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      const auto number = static_cast<std::uint32_t>(tables.parts.size());
      if (!edges.try_emplace(std::uint64_t{a} << 32 | b, number).second) continue;
      owned[k] = static_cast<float>(number);
      tables.parts.push_back({static_cast<float>(a), static_cast<float>(b), 0, 0});
    }
    const auto corner = [&](std::size_t k) { return static_cast<float>(triangle[k]); };
    tables.faces.push_back(
        {{corner(0), corner(1), corner(2)}, 0, {owned[0], owned[1], owned[2]}, static_cast<float>(corners)});
    middles.push_back(
        (rest.positions[triangle[0]] + rest.positions[triangle[1]] + rest.positions[triangle[2]]) / 3);
  }
  if (!middles.empty()) Tree(tables, middles).build();
  return tables;
}

}  // namespace clothstream::simulation
