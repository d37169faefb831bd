// SPDX-License-Identifier: MIT
// Scenes of the program: loaded by name and from files, and adjusted by options of `step`. Every function
// throws std::runtime_error if a scene is invalid.
#pragma once

#include <string>
#include <vector>

#include "server/model/scene.h"
#include "server/options/program_options.h"

namespace clothstream::program {

// Loads the built-in scene with that name, or the file with that path.
model::Scene loadScene(const std::string& nameOrPath);

// Returns the scene with the rate and the substeps that the options of `step` give it.
model::Scene adjusted(model::Scene scene, const StepOptions& options);

// Built-in scenes and those from files. A file replaces a built-in scene of the same name. `builtIn` gets the
// names of those that are not replaced.
std::vector<model::Scene> loadScenes(const ServeOptions& options, std::vector<std::string>& builtIn);

}  // namespace clothstream::program
