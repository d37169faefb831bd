// SPDX-License-Identifier: MIT
// Strain of a cloth's springs.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "clients/measure/strain.h"
#include "server/model/springs.h"
#include "server/simulation/state_snapshot.h"
#include "tests/bench/samples.h"

namespace clothstream::bench {

// Strain of each structural spring of the scene's only cloth, as part of its rest length. Negative for
// compressed springs.
inline Samples structuralStrains(const model::Cloth& cloth, const simulation::NodeState& state) {
  std::vector<measure::Edge> edges;
  for (const model::SpringLink& link : model::springLinks(cloth))
    if (link.kind == model::SpringKind::structural)
      edges.push_back({link.a, link.b, double{link.restLength}});
  static_assert(sizeof(model::Vec3) == 3 * sizeof(float));
  const std::span<const float> positions(state.positions.data()->data(), 3 * state.positions.size());
  Samples strains;
  for (const double strain : measure::strainsOf(edges, positions)) strains.add(strain);
  return strains;
}

// The largest strain of any spring, also of shear and bend springs.
inline double largestStrain(const model::Cloth& cloth, const simulation::NodeState& state) {
  double largest = 0;
  for (const model::SpringLink& link : model::springLinks(cloth)) {
    const double length = (state.positions[link.b] - state.positions[link.a]).norm();
    largest = std::max(largest, length / double{link.restLength} - 1);
  }
  return largest;
}

}  // namespace clothstream::bench
