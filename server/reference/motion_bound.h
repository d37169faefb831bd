// SPDX-License-Identifier: MIT
// Bound on the motion of nodes that keeps cloth from passing through cloth, in double precision. Every pair
// is checked; there is no tree.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/reference/contact.h"

namespace clothstream::reference {

// The shortest line between two convex sets: from the second to the first one. `weights` of the four corners
// give its ends; those of each set add up to 1.
struct ShortestLine {
  Vec3 line = Vec3::Zero();
  std::array<double, 4> weights{};
};
ShortestLine shortestBetweenEdges(const std::array<Vec3, 4>& corners);  // two edges
ShortestLine shortestToTriangle(const std::array<Vec3, 4>& corners);    // a point and a triangle

// All cloths of a scene that nothing passes through. Node numbers follow the order of the cloths.
class MotionBound {
 public:
  explicit MotionBound(const model::Scene& scene);

  // True if nothing passes through a cloth of the scene.
  bool exists() const { return !pairs_.empty(); }

  // Corrects a substep of h seconds from `start` to `positions`.
  void apply(std::span<const Vec3> start, std::span<Vec3> positions, std::span<Vec3> velocities,
             std::span<const double> inverseMasses, double h) const;

 private:
  struct Pair {
    std::array<std::uint32_t, 4> nodes;
    std::uint32_t second;  // first corner of the second set: 1 for a node and a triangle, 2 for two edges
  };
  ShortestLine lineOf(const Pair& pair, std::span<const Vec3> positions) const;
  double leastDistance(const Pair& pair, std::span<const Vec3> positions) const;
  void separate(std::span<const Pair> near, std::span<const Vec3> start, std::span<Vec3> positions,
                std::span<Vec3> velocities, std::span<const double> inverseMasses, double h) const;

  std::vector<Pair> pairs_;  // all pairs without a common node
  double gap_ = 0;           // m
};

}  // namespace clothstream::reference
