// SPDX-License-Identifier: MIT
#include "server/program/scenes.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"

namespace clothstream::program {
namespace {

using Repairs = std::vector<v1::MeshRepair>;

model::Scene loaded(messages::Result<model::Scene> scene, const Repairs& repairs) {
  if (!scene) throw std::runtime_error(scene.error().text);
  for (const v1::MeshRepair& repair : repairs)
    for (const std::string& sentence : repair.sentences())
      spdlog::info("{}: cloth '{}': {}", scene->name, repair.cloth(), sentence);
  return std::move(*scene);
}

// The largest stream rate that divides the new simulation rate and is not above the scene's own.
std::uint32_t streamRateFor(const model::Scene& scene, std::uint32_t rate) {
  std::uint32_t streamRate = std::min(scene.streamRate, rate);
  while (rate % streamRate != 0) --streamRate;
  return streamRate;
}

}  // namespace

model::Scene loadScene(const std::string& nameOrPath) {
  Repairs repairs;
  return loaded(messages::loadScene(nameOrPath, &repairs), repairs);
}

model::Scene adjusted(model::Scene scene, const StepOptions& options) {
  if (options.rate) {
    scene.streamRate = streamRateFor(scene, *options.rate);
    scene.simulationRate = *options.rate;
  }
  scene.substeps = options.substeps.value_or(scene.substeps);
  auto checked = messages::toScene(messages::toMessage(scene));
  if (!checked)
    throw std::runtime_error(
        fmt::format("scene '{}' with these options: {}", scene.name, checked.error().text));
  return std::move(*checked);
}

std::vector<model::Scene> loadScenes(const ServeOptions& options, std::vector<std::string>& builtIn) {
  builtIn = messages::namedScenes();
  std::vector<model::Scene> scenes;
  for (const std::string& name : messages::namedScenes()) scenes.push_back(loadScene(name));
  for (const std::filesystem::path& file : options.sceneFiles) {
    Repairs repairs;
    model::Scene scene = loaded(messages::readSceneFile(file, &repairs), repairs);
    std::erase_if(scenes, [&](const model::Scene& other) { return other.name == scene.name; });
    std::erase(builtIn, scene.name);
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

}  // namespace clothstream::program
