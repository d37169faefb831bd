// SPDX-License-Identifier: MIT
// Finds scenes that are built into the program.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "server/meshes/mesh_file.h"
#include "server/messages/embedded_scenes.h"
#include "server/messages/scene_file.h"

namespace clothstream::messages {

namespace {

tl::expected<meshes::MeshSource, std::string> readEmbeddedMesh(const std::string& file,
                                                               const meshes::JointRequest* /*joints*/) {
  const auto all = embeddedMeshes();
  const auto mesh = std::ranges::find(all, file, &EmbeddedMesh::file);
  if (mesh == all.end()) return tl::unexpected(std::string("is not built into the program"));
  return meshes::parseObj(mesh->obj);
}

}  // namespace

std::vector<std::string> namedScenes() {
  std::vector<std::string> names;
  for (const EmbeddedScene& scene : embeddedScenes()) names.emplace_back(scene.name);
  return names;
}

Result<model::Scene> loadScene(const std::string& nameOrPath, std::vector<v1::MeshRepair>* repairs) {
  const auto scenes = embeddedScenes();
  const auto scene = std::ranges::find(scenes, nameOrPath, &EmbeddedScene::name);
  if (scene != scenes.end())
    return parseScene(scene->json, fmt::format("scene {}", nameOrPath), readEmbeddedMesh, limits::kMaxNodes,
                      repairs);
  return readSceneFile(nameOrPath, repairs).map_error([](FieldError error) {
    if (error.code == v1::ERROR_CODE_NOT_FOUND)
      error.text +=
          fmt::format(", and no scene of that name; named scenes are {}", fmt::join(namedScenes(), ", "));
    return error;
  });
}

}  // namespace clothstream::messages
