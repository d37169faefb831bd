// SPDX-License-Identifier: MIT
// Scenes in files and by name. A scene file is the Scene message in the JSON form of protobuf.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "server/messages/field_error.h"
#include "server/messages/limits.h"
#include "server/messages/mesh_message.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Error texts start with `source`, such as a file name. Unknown fields are errors. Mesh files are refused if
// there is no reader. `maxNodes` and `repairs` as for toScene().
[[nodiscard]] Result<model::Scene> parseScene(std::string_view json, std::string_view source,
                                              const MeshReader& readMesh = {},
                                              std::uint64_t maxNodes = limits::kMaxNodes,
                                              std::vector<v1::MeshRepair>* repairs = nullptr);

// Reads a file of at most limits::kMaxSceneFileBytes. Paths of meshes are relative to the file.
[[nodiscard]] Result<model::Scene> readSceneFile(const std::filesystem::path& path,
                                                 std::vector<v1::MeshRepair>* repairs = nullptr);

// Writes every field. parseScene() of the result returns the same scene.
std::string toJson(const model::Scene& scene);

// Names of the scenes that are built into the program (server/scenes/), sorted.
std::vector<std::string> namedScenes();

// Loads the built-in scene with that name, or the file with that path.
[[nodiscard]] Result<model::Scene> loadScene(const std::string& nameOrPath,
                                             std::vector<v1::MeshRepair>* repairs = nullptr);

}  // namespace clothstream::messages
