// SPDX-License-Identifier: MIT
// Suite coarse: a sheet with a coarse correction beside the same sheet with springs alone and four times the
// substeps. It swings down from two corners, and then a ball is pushed 0.4 m through it.
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include "server/model/coarse_level.h"
#include "server/reference/reference_cloth.h"
#include "server/simulation/software_threads.h"
#include "tests/bench/hung_cloth.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kFramesPerSecond = 60;
constexpr std::uint32_t kPushFrame = 2 * kFramesPerSecond;   // the ball starts
constexpr std::uint32_t kEndFrame = 6 * kFramesPerSecond;    // strain after the push
constexpr std::uint32_t kCalmFrame = 15 * kFramesPerSecond;  // energy without a ball
constexpr float kBallRadius = 0.2f;

struct Setting {
  std::uint32_t size, substeps;
  std::optional<model::CoarseCorrection> coarse;
};

constexpr model::CoarseCorrection kCorrection4{4, 4, 2}, kCorrection8{8, 6, 2}, kCorrection16{16, 6, 2},
    kTwoLevels{16, 3, 2, 2}, kEverySubstep{16, 3, 1, 2};

const Setting kSettings[] = {{32, 4, kCorrection4},
                             {32, 8, kCorrection8},
                             {32, 4, kEverySubstep},
                             {32, 16, {}},
                             {32, 32, {}},
                             {64, 3, kCorrection4},
                             {64, 4, kCorrection8},
                             {64, 4, kTwoLevels},
                             {64, 6, kTwoLevels},
                             {64, 16, {}},
                             {64, 24, {}},
                             {128, 4, kCorrection8},
                             {128, 4, kTwoLevels},
                             {128, 6, kTwoLevels},
                             {128, 16, {}},
                             {128, 24, {}},
                             {256, 4, kCorrection16},
                             {256, 4, kTwoLevels},
                             {256, 8, kTwoLevels},
                             {256, 16, {}},
                             {256, 32, {}}};

// Springs are as stiff as the step allows, with the damping that a coarse correction needs.
model::Scene sceneOf(const Setting& setting) {
  model::Scene scene = swingingSheet(setting.size, {}, setting.substeps);
  model::Cloth& cloth = scene.cloths.front();
  const double h = scene.substepSeconds(), bearable = double{cloth.nodeMass()} / (h * h);
  cloth.structural = {static_cast<float>(0.28 * bearable), 1.001f * model::leastCoarseDamping(cloth, h)};
  cloth.shear.stiffness = static_cast<float>(0.08 * bearable);
  cloth.bend.stiffness = static_cast<float>(0.04 * bearable);
  cloth.coarse = setting.coarse;
  return scene;
}

// The ball's centre passes half a metre below the pins.
simulation::TickInputs inputsAt(const model::Scene& scene, std::uint32_t frame, float speed) {
  simulation::TickInputs inputs{scene.environment, {}};
  if (speed == 0) return inputs;
  const model::Grid& grid = scene.cloths.front().grid;
  const std::vector<model::Vec3> rest = restPositions(grid);
  const model::Vec3 middle = (rest.front() + rest[grid.columns - 1]) / 2;
  const auto at = [&](std::uint32_t f) {
    const float seconds = static_cast<float>(std::max(f, kPushFrame) - kPushFrame) / kFramesPerSecond;
    model::Pose pose;
    pose.position = middle + model::Vec3(0, -0.5f, std::min(speed * seconds - 0.5f, 0.4f));
    return pose;
  };
  inputs.colliders = {{.shape = model::Sphere{kBallRadius}, .start = at(frame), .end = at(frame + 1)}};
  return inputs;
}

Row rowOf(vulkan::Device& device, const Setting& setting, float speed) {
  const model::Scene scene = sceneOf(setting);
  Simulated simulated(device, scene, {});
  // Every pair of means may lie at its largest distance, where rounding decides whether it acts.
  if (setting.size <= 64) simulated.check(inputsAt(scene, 0, speed));
  simulated.restart();
  const std::uint32_t frames = speed > 0 ? kEndFrame : kCalmFrame;
  double largest = 0;
  const auto measured = [&] { return measuredCloth(scene.cloths.front(), simulated.state()); };
  for (std::uint32_t frame = 0; frame < frames; ++frame) {
    simulated.tick(inputsAt(scene, frame, speed));
    if (frame >= kPushFrame && frame % 6 == 0) largest = std::max(largest, measured().strain().mean);
  }
  const reference::ReferenceCloth end = measured();
  const double nodes = scene.nodeCount();
  return {{"suite", "coarse"},
          {"nodes", scene.nodeCount()},
          {"substeps", setting.substeps},
          {"cells", setting.coarse ? setting.coarse->cells : 0},
          {"sweeps", setting.coarse ? setting.coarse->sweeps : 0},
          {"every", setting.coarse ? setting.coarse->every : 0},
          {"levels", setting.coarse ? setting.coarse->levels : 0},
          {"ballSpeed", speed},
          {"nsPerNodeFrame", simulated.wall().median() / nodes * 1e9},
          {"nsPerNodeFrameMin", simulated.wall().min() / nodes * 1e9},
          {"strainMean", end.strain().mean},
          {"strainP99", end.strain().p99},
          {"largestStrainMean", largest},
          {"kineticEnergy", end.kineticEnergy()},
          {"device", device.info().name}};
}

}  // namespace

void runCoarse(vulkan::Device&, const Settings& settings, const RowSink& add) {
  bool known = false;
  for (const Setting& setting : kSettings) {
    if (settings.size && *settings.size != setting.size) continue;
    known = true;
    vulkan::Device device(simulation::suitedTo(setting.size * setting.size, settings.device));
    for (const float speed : {0.0f, 1.0f, 5.0f}) add(rowOf(device, setting, speed));
  }
  if (!known) throw std::runtime_error("--size: use 32, 64, 128 or 256");
}

}  // namespace clothstream::bench
