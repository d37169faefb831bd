// SPDX-License-Identifier: MIT
// Nodes as balls that keep out of each other, in double precision: every pair looked at, none listed ahead.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/reference/contact.h"

namespace clothstream::reference {

// Of a whole scene; nodes are numbered as its cloths follow each other.
class SelfCollision {
 public:
  explicit SelfCollision(const model::Scene& scene);

  // Whether any cloth has it.
  bool exists() const { return !balls_.empty(); }

  // Two nodes that are nearer than their radii add up to, and not neighbours at rest.
  struct Pair {
    std::uint32_t a, b;  // a < b
    double distance;
  };
  // By a, then by b. `reach`: factor on the distance at which two nodes count as a pair.
  std::vector<Pair> pairs(std::span<const Vec3> positions, double reach = 1) const;

  // One iteration in a substep of h seconds: impulses to all pairs at once, by mass splitting, and positions
  // after them. Returns one byte a node: whether it touches another.
  std::vector<std::uint8_t> resolve(std::span<Vec3> positions, std::span<Vec3> velocities,
                                    std::span<const double> inverseMasses, double h) const;

 private:
  struct Ball {
    std::uint32_t node, cloth;
    double radius, friction;
    Vec3 rest;
  };
  std::vector<Ball> balls_;          // by node
  std::vector<std::uint32_t> ball_;  // of a node; meaningless where it has none
  double longest_ = 0;               // m, the largest sum of two radii
  std::uint32_t nodeCount_ = 0;
};

}  // namespace clothstream::reference
