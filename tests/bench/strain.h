// SPDX-License-Identifier: MIT
// Strain of a cloth's structural springs.
#pragma once

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

}  // namespace clothstream::bench
