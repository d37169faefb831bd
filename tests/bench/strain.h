// SPDX-License-Identifier: MIT
// Strain of a cloth's structural springs.
#pragma once

#include "server/model/springs.h"
#include "server/simulation/state_snapshot.h"
#include "tests/bench/samples.h"

namespace clothstream::bench {

// Strain of each structural spring of the scene's only cloth, as part of its rest length. Negative for
// compressed springs.
inline Samples structuralStrains(const model::Cloth& cloth, const simulation::NodeState& state) {
  Samples strains;
  for (const model::SpringLink& link : model::springLinks(cloth))
    if (link.kind == model::SpringKind::structural)
      strains.add(double{(state.positions[link.b] - state.positions[link.a]).norm() / link.restLength} - 1);
  return strains;
}

}  // namespace clothstream::bench
