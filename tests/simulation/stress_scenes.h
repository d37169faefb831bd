// SPDX-License-Identifier: MIT
// Scenes in which cloth is pressed, struck and crumpled so hard that balls alone let it pass through itself.
#pragma once

#include <functional>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::tests {

struct StressScene {
  model::Scene scene;  // its cloths have self-collision
  simulation::NodeState start;
  std::function<std::vector<simulation::MovingCollider>(int tick)> colliders;
  int ticks = 0;  // until its motion is complete
};

// Five scenes. `nothingPasses` is that of their cloths.
std::vector<StressScene> stressScenes(bool nothingPasses);

}  // namespace clothstream::tests
