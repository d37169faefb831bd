// SPDX-License-Identifier: MIT
#include "tests/bench/codec/bench_motion.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "clients/files/motion_file.h"
#include "server/messages/scene_file.h"
#include "server/model/mesh.h"
#include "tests/bench/cloth_motion.h"
#include "tests/bench/resized.h"
#include "tests/bench/simulated.h"

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kDefaultSize = 100;
constexpr std::size_t kWithoutDevice = 4;

struct Named {
  const char* name;
  const char* scene;  // scene of the server; null: motion of cloth_motion.h
  // Frames until a flag is in the air.
  std::uint32_t warmUp = 0;
  float wind = 1, gust = 1;  // factors on the scene's values
};

constexpr std::array kMotions{Named{"drape", nullptr},
                              Named{"curtain", nullptr},
                              Named{"light_flag", nullptr},
                              Named{"violent_flag", nullptr},
                              Named{"simulated_drape", "sphere_drop"},
                              Named{"simulated_curtain", "curtain"},
                              Named{"simulated_light_flag", "flag", 72},
                              Named{"simulated_violent_flag", "flag", 72, 2, 4},
                              Named{"simulated_folds", "folds"},
                              Named{"simulated_mesh", "tablecloth"}};

BenchMotion played(const Named& named, const Settings& settings) {
  MotionSettings motion{.name = named.name, .frames = settings.frames};
  motion.size = settings.size.value_or(kDefaultSize);
  const std::string_view name = named.name;
  if (name == "curtain") motion.scene = MotionScene::curtain;
  if (name.ends_with("flag")) motion.scene = MotionScene::flag;
  if (name == "light_flag") motion.wind = 0.5;
  return {named.name, {motion.size * motion.size, motion.size, motion.size, {}}, [motion](const auto& use) {
            playMotion(motion, [&](std::uint32_t, std::span<const float> positions) { use(positions); });
          }};
}

model::Scene sceneOf(const Named& named, const Settings& settings) {
  auto loaded = messages::loadScene(named.scene);
  if (!loaded) throw std::runtime_error(fmt::format("unknown scene {}", named.scene));
  model::Scene scene = std::move(*loaded);
  scene.environment.wind *= named.wind;
  scene.environment.gust.strength *= named.gust;
  model::Cloth& cloth = scene.cloths.front();
  if (!cloth.mesh) resize(cloth, settings.size.value_or(kDefaultSize));
  raiseSubsteps(scene);
  return scene;
}

BenchMotion simulated(vulkan::Device& device, const Named& named, const Settings& settings) {
  const model::Scene scene = sceneOf(named, settings);
  const model::Cloth& cloth = scene.cloths.front();
  codec::ClothLayout layout{cloth.nodeCount(), cloth.grid.rows, cloth.grid.columns, {}};
  if (cloth.mesh) {
    layout.rows = layout.columns = 0;
    for (const model::Triangle& triangle : cloth.mesh->shape.triangles)
      layout.triangles.insert(layout.triangles.end(), triangle.begin(), triangle.end());
    for (const model::Vec3& position : cloth.mesh->shape.positions)
      layout.restPositions.insert(layout.restPositions.end(), {position.x(), position.y(), position.z()});
  }
  return {named.name, layout,
          [&device, scene, warmUp = named.warmUp, frames = settings.frames](const auto& use) {
            Simulated simulated(device, scene, {});
            std::vector<float> positions(3 * std::size_t{scene.nodeCount()});
            for (std::uint32_t tick = 0; tick < warmUp + frames; ++tick) {
              simulated.tick(simulation::inputsAt(scene, tick));
              if (tick < warmUp) continue;
              const simulation::NodeState state = simulated.state();
              for (std::size_t node = 0; node < state.positions.size(); ++node)
                for (int axis = 0; axis < 3; ++axis)
                  positions[3 * node + static_cast<std::size_t>(axis)] = state.positions[node][axis];
              use(positions);
            }
          }};
}

BenchMotion read(const std::filesystem::path& path, const Settings& settings) {
  const auto open = [path] {
    auto reader = files::MotionReader::open(path);
    if (!reader) throw std::runtime_error(reader.error());
    return std::move(*reader);
  };
  return {path.stem().string(), open().shape().cloth(), [open, most = settings.frames](const auto& use) {
            files::MotionReader reader = open();
            for (std::uint32_t frame = 0; frame < std::min(most, reader.shape().frames); ++frame) {
              const auto positions = reader.next();
              if (!positions) throw std::runtime_error(positions.error());
              use(*positions);
            }
          }};
}

}  // namespace

std::vector<std::string> motionNames() {
  std::vector<std::string> names;
  for (const Named& named : kMotions) names.emplace_back(named.name);
  return names;
}

std::vector<BenchMotion> chosenMotions(vulkan::Device& device, const Settings& settings) {
  if (settings.input) return {read(*settings.input, settings)};
  std::vector<std::string> names = settings.motions;
  if (names.empty()) names = motionNames(), names.resize(kWithoutDevice);
  std::vector<BenchMotion> motions;
  for (const std::string& name : names) {
    const auto named = std::ranges::find(kMotions, name, &Named::name);
    if (named == kMotions.end()) throw std::runtime_error(fmt::format("unknown motion {}", name));
    motions.push_back(named->scene == nullptr ? played(*named, settings)
                                              : simulated(device, *named, settings));
  }
  return motions;
}

}  // namespace clothstream::bench
