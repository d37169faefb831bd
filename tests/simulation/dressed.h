// SPDX-License-Identifier: MIT
// Measures how well clothes stay on a figure that walks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/model/scene.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {

// The worst values of a walk.
struct Wear {
  double depth = 0;           // m, of a node below the surface of a collider
  double strain = 0;          // 99th percentile over the structural springs of a cloth
  double excess = 0;          // distance from the skinned place over the largest distance, less 1
  double astray = 0;          // m, of a node that follows its joints exactly, from its place
  std::size_t crossings = 0;  // edges through triangles, of cloths with self-collision
  std::uint64_t depthTick = 0, strainTick = 0, excessTick = 0, crossingsTick = 0;
};

// A scene with a figure as its first collider, whose joints its cloths follow.
class Walk {
 public:
  explicit Walk(const model::Scene& scene);

  // Simulates more ticks. Depth and strain are measured after each; what needs the positions of all nodes,
  // after each `every`-th.
  void on(std::uint64_t ticks, std::uint64_t every);
  const Wear& wear() const { return wear_; }
  std::string text() const;
  // Smallest distance of the nodes that follow exactly from the figure's surface now, m; negative inside.
  double nearestExact();

 private:
  void measurePositions(const simulation::TickInputs& inputs);

  model::Scene scene_;
  Running running_;
  std::uint64_t ticks_ = 0;
  Wear wear_;
};

}  // namespace clothstream::tests
