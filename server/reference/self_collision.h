// SPDX-License-Identifier: MIT
// Nodes as balls that repel each other, in double precision. Every pair is checked; there are no lists.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/reference/contact.h"

namespace clothstream::reference {

// Self-collision of a whole scene. Node numbers follow the order of the cloths.
class SelfCollision {
 public:
  explicit SelfCollision(const model::Scene& scene);

  // True if a cloth has self-collision.
  bool exists() const { return !balls_.empty(); }

  // Two nodes closer than the sum of their radii that are not neighbours at rest.
  struct Pair {
    std::uint32_t a, b;  // a < b
    double distance;
  };
  // Pairs, ordered by a, then by b. `reach` is a factor of the distance at which two nodes count as a pair.
  std::vector<Pair> pairs(std::span<const Vec3> positions, double reach = 1) const;

  // One iteration in a substep of h seconds: impulses to all pairs at once by mass splitting, then positions.
  // Returns one byte per node: 1 if it touches another node.
  std::vector<std::uint8_t> resolve(std::span<Vec3> positions, std::span<Vec3> velocities,
                                    std::span<const double> inverseMasses, double h) const;

 private:
  struct Ball {
    std::uint32_t node, cloth;
    double radius, friction;
    Vec3 rest;
  };
  std::vector<Ball> balls_;          // by node
  std::vector<std::uint32_t> ball_;  // by node; meaningless if it has no ball
  double longest_ = 0;               // m, the largest sum of two radii
  std::uint32_t nodeCount_ = 0;
};

}  // namespace clothstream::reference
