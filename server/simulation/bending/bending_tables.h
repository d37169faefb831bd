// SPDX-License-Identifier: MIT
// Hinges of a scene as the kernels read them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "shaders/bending/bending.h"
#include "shaders/shared/types.h"

namespace clothstream::simulation {

struct BendingTables {
  std::vector<shared::HingeRecord> hinges;
  std::vector<shared::HingeListRecord> incidences;  // a node of the scene
  std::vector<shared::vec4> lists;
};

// Of the cloths with dihedral bending.
BendingTables bendingTables(std::span<const model::Cloth> cloths);

}  // namespace clothstream::simulation
