// SPDX-License-Identifier: MIT
// Tables of the hinges of a scene.
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
  std::vector<shared::ListRecord> incidences;  // by node of the scene: its texels of `lists`
  std::vector<shared::HingeNumbers> lists;
};

// Tables of the cloths with dihedral bending.
BendingTables bendingTables(std::span<const model::Cloth> cloths);

}  // namespace clothstream::simulation
