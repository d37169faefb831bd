// SPDX-License-Identifier: MIT
// The constraints of a scene as the kernels read them.
#pragma once

#include <span>
#include <vector>

#include "server/scene/scene.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

struct ConstraintTables {
  std::vector<shared::SystemRecord> systems;  // a cloth with constraints: first those that always have all
  std::uint32_t always = 0;                   // of the systems
  std::vector<shared::LinkRecord> links;      // in the order of scene::springLinks(), cloth by cloth
  std::vector<shared::IncidenceRecord> incidences;  // a node of the scene
  std::vector<shared::vec4> lists;
};

// Springs between two pinned nodes are left out: nothing can move there.
ConstraintTables constraintTables(std::span<const scene::Cloth> cloths);

}  // namespace clothstream::simulation
