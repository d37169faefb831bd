// SPDX-License-Identifier: MIT
#include "server/scene/solver_easing.h"

#include <algorithm>
#include <cmath>

namespace clothstream::scene {

void SolverEasing::change(const model::Scene& before, model::Scene& changed, std::uint64_t tick) {
  const auto part = static_cast<float>(changed.substepSeconds() / kTime);
  for (std::size_t i = 0; i < changed.cloths.size(); ++i) {
    model::Solver& solver = changed.cloths[i].solver;
    if (solver.kind != before.cloths[i].solver.kind)
      until_[i] = tick + static_cast<std::uint64_t>(std::ceil(kSeconds * changed.simulationRate));
    if (until_[i] > tick) solver.correctionFraction = std::min(part, model::correctionFraction(solver));
  }
}

bool SolverEasing::end(model::Scene& scene, std::uint64_t tick) const {
  bool changed = false;
  for (std::size_t i = 0; i < until_.size(); ++i) {
    if (until_[i] != tick || !scene.cloths[i].solver.correctionFraction) continue;
    scene.cloths[i].solver.correctionFraction.reset();
    changed = true;
  }
  return changed;
}

std::vector<model::Cloth> SolverEasing::removedFrom(std::vector<model::Cloth> cloths) {
  for (model::Cloth& cloth : cloths) cloth.solver.correctionFraction.reset();
  return cloths;
}

}  // namespace clothstream::scene
