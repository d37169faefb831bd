// SPDX-License-Identifier: MIT
// Scenes that need every kernel of the server.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::kernel_survey {

struct SurveyScene {
  std::string name;
  model::Scene scene;
  // The same scene with more nodes, for what a kernel costs a node. Absent if it has only one size.
  std::optional<model::Scene> larger = {};
};

// A sheet with every solver as grid and as mesh, each small enough for one workgroup and too large for it,
// and what else needs kernels: Runge-Kutta steps, bending, self-collision, tethers, attachments. Then the
// built-in scenes. Throws std::runtime_error if a built-in scene cannot be loaded.
std::vector<SurveyScene> surveyScenes();

}  // namespace clothstream::kernel_survey
