// SPDX-License-Identifier: MIT
// How far a cloth's structural springs are stretched.
#pragma once

#include "server/model/springs.h"
#include "server/simulation/state_snapshot.h"
#include "tests/bench/samples.h"

namespace clothstream::bench {

// Of each structural spring of a scene's only cloth: parts of its length at rest, negative where it is
// shorter.
inline Samples structuralStrains(const model::Cloth& cloth, const simulation::NodeState& state) {
  Samples strains;
  for (const model::SpringLink& link : model::springLinks(cloth))
    if (link.kind == model::SpringKind::structural)
      strains.add(double{(state.positions[link.b] - state.positions[link.a]).norm() / link.restLength} - 1);
  return strains;
}

}  // namespace clothstream::bench
