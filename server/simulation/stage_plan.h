// SPDX-License-Identifier: MIT
// What a change of cloths makes.
#pragma once

#include <vector>

#include "server/model/scene.h"

namespace clothstream::simulation {

// Lists the cloths for which a simulation lacks stages.
struct StagePlan {
  std::vector<model::Cloth> solvers;  // cloths whose solvers need stages; empty: none do
  std::vector<model::Cloth> bending;  // cloths of the tables of bending; empty: they need no new ones
};
struct NewStages;  // kept_stages.h

}  // namespace clothstream::simulation
