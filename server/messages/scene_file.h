// SPDX-License-Identifier: MIT
// Scenes on disk and by name: the Scene message in protobuf's JSON form.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "server/messages/field_error.h"
#include "server/messages/mesh_message.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// `source` (a file's name) opens the text of an error. Unknown fields are errors. Meshes may be named as
// files only where there is a reader.
[[nodiscard]] Result<model::Scene> parseScene(std::string_view json, std::string_view source,
                                              const MeshReader& readMesh = {});

// A file of at most limits::kMaxSceneFileBytes; the meshes that it names lie relative to it.
[[nodiscard]] Result<model::Scene> readSceneFile(const std::filesystem::path& path);

// With every field; parseScene() of it gives the scene back.
std::string toJson(const model::Scene& scene);

// Names of the scenes that are built into the program (server/scenes/), sorted.
std::vector<std::string> namedScenes();

// The named scene of that name, else the file of that path.
[[nodiscard]] Result<model::Scene> loadScene(const std::string& nameOrPath);

}  // namespace clothstream::messages
