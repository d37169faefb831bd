// SPDX-License-Identifier: MIT
// The springs of implicit cloths as the kernels read them.
#pragma once

#include <span>
#include <vector>

#include "server/scene/scene.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

struct ImplicitTables {
  std::vector<shared::SystemRecord> systems;        // an implicit cloth
  std::vector<shared::LinkRecord> springs;          // in the order of scene::springLinks(), cloth by cloth
  std::vector<shared::IncidenceRecord> incidences;  // a node of the scene
  std::vector<shared::SpringEndsRecord> lists;
};

// Springs between two pinned nodes are left out: nothing can move there.
ImplicitTables implicitTables(std::span<const scene::Cloth> cloths);

}  // namespace clothstream::simulation
