// SPDX-License-Identifier: MIT
// Suite self_collision: cost of self-collision for a sheet that lies flat or in folds, and in the scene
// folds.
#include "server/reference/self_collision.h"

#include <algorithm>
#include <random>
#include <stdexcept>

#include <fmt/format.h>

#include "server/messages/scene_file.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"
#include "tests/simulation/intersections.h"

namespace clothstream::bench {
namespace {

constexpr float kSpacing = 0.02f;     // m
constexpr std::uint32_t kPanel = 12;  // rows from fold to fold
constexpr int kSettling = 144;        // ticks

model::Scene sheetOnFloor(std::uint32_t size, bool balls) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = kSpacing * static_cast<float>(size - 1);
  cloth.mass = 0.01f * static_cast<float>(cloth.grid.nodeCount());
  cloth.structural = {100, 0.1f};
  cloth.shear = {50, 0.05f};
  cloth.bend = {2, 0.01f};
  cloth.damping = 0.5f;
  if (balls) cloth.selfCollision = model::SelfCollision{.radius = kSpacing / 2};
  model::Scene scene;
  scene.name = "sheet";
  scene.cloths = {cloth};
  return scene;
}

// On the floor in one layer, or back and forth in touching layers; slightly displaced, so that nothing is
// regular.
simulation::NodeState lying(const model::Scene& scene, bool folds) {
  simulation::NodeState state = simulation::restState(scene.cloths);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  const std::uint32_t columns = scene.cloths[0].grid.columns;
  const std::uint32_t panel = folds ? kPanel : scene.cloths[0].grid.rows;
  for (std::uint32_t i = 0; i < state.positions.size(); ++i) {
    const std::uint32_t row = i / columns, fold = row / panel, along = row % panel;
    model::Vec3& p = state.positions[i];
    p.y() = 0.01f + kSpacing * static_cast<float>(fold);
    p.z() = kSpacing * static_cast<float>(fold % 2 == 0 ? along : panel - 1 - along);
    p += 0.1f * kSpacing * model::Vec3(unit(random), unit(random), unit(random));
  }
  return state;
}

std::size_t touching(const model::Scene& scene, const simulation::NodeState& state) {
  std::vector<reference::Vec3> positions;
  for (const model::Vec3& p : state.positions) positions.push_back(p.cast<double>());
  return reference::SelfCollision(scene).pairs(positions).size();
}

// Number of places where the cloth passes through itself. A sheet without self-collision has thousands.
std::size_t crossingsIn(const model::Scene& scene, const simulation::NodeState& state) {
  const std::size_t crossings = tests::intersections(scene, state.positions);
  if (crossings > scene.nodeCount() / 100)
    throw std::runtime_error(fmt::format("{} with {} nodes passes through itself {} times", scene.name,
                                         scene.nodeCount(), crossings));
  return crossings;
}

// Returns the number of neighbour lists that were too long.
std::uint64_t measure(Simulated& simulated, const simulation::TickInputs& inputs, double seconds) {
  simulated.forgetTimes();
  std::uint64_t crowded = 0;
  double spent = 0;
  while (spent < seconds || simulated.wall().count() < 7) {
    spent += secondsOf([&] { simulated.tick(inputs); });
    crowded += simulated.status().crowded;
  }
  return crowded;
}

void addTimes(nlohmann::ordered_json& row, const Simulated& simulated, const model::Scene& scene,
              const vulkan::Device& device) {
  const double nodeSteps = static_cast<double>(scene.nodeCount()) * scene.substeps;
  row["tickMsMedian"] = simulated.wall().median() * 1e3;
  row["tickMsP99"] = simulated.wall().p99() * 1e3;
  row["nsMin"] = simulated.wall().min() / nodeSteps * 1e9;
  row["nsMedian"] = simulated.wall().median() / nodeSteps * 1e9;
  row["ticks"] = simulated.wall().count();
  row["device"] = device.info().name;
}

nlohmann::ordered_json sheet(vulkan::Device& device, const Settings& settings, std::uint32_t size, bool folds,
                             bool balls) {
  const model::Scene scene = sheetOnFloor(size, balls);
  const model::Pose floor{};
  const simulation::TickInputs inputs{scene.environment, {{model::Plane{}, floor, floor, 1}}};
  Simulated simulated(device, scene, {settings.rowsPerInvocation, settings.workgroupSize, {}});
  const simulation::NodeState start = lying(scene, folds);
  // A pair that touches in one and just misses in the other gets a contact's impulse a substep earlier and
  // passes it on. That is up to gravity's speed times a few substeps, 1e-4 m. Without contacts the folds
  // would be millimetres off.
  const Tolerance tolerance{.node = kSpacing / 100};
  const double referenceSeconds = simulated.check(start, inputs, tolerance);
  simulated.restart(start);
  for (int tick = 0; tick < kSettling; ++tick) simulated.tick(inputs);
  const std::uint64_t crowded = measure(simulated, inputs, settings.seconds);
  const simulation::NodeState end = simulated.state();
  nlohmann::ordered_json row{
      {"suite", "self_collision"}, {"size", size},       {"lies", folds ? "folds" : "flat"},
      {"selfCollision", balls},    {"crowded", crowded}, {"referenceMs", referenceSeconds * 1e3}};
  if (balls) {
    row["touching"] = touching(scene, end);
    row["crossings"] = crossingsIn(scene, end);
  }
  addTimes(row, simulated, scene, device);
  return row;
}

// From the sheet's fall on, as a server would run it.
nlohmann::ordered_json foldsScene(vulkan::Device& device, const Settings& settings) {
  const auto scene = messages::loadScene("folds");
  if (!scene) throw std::runtime_error(scene.error().text);
  simulation::TickInputs inputs{scene->environment, {}};
  for (const model::Collider& collider : scene->colliders)
    inputs.colliders.push_back({collider.shape, collider.pose, collider.pose, collider.friction});
  Simulated simulated(device, *scene, {settings.rowsPerInvocation, settings.workgroupSize, {}});
  const std::uint64_t crowded = measure(simulated, inputs, std::max(settings.seconds, 3.0));
  const simulation::NodeState end = simulated.state();
  nlohmann::ordered_json row{{"suite", "self_collision"},         {"scene", scene->name},
                             {"nodes", scene->nodeCount()},       {"crowded", crowded},
                             {"touching", touching(*scene, end)}, {"crossings", crossingsIn(*scene, end)}};
  addTimes(row, simulated, *scene, device);
  return row;
}

}  // namespace

void runSelfCollision(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const std::vector<std::uint32_t> sizes =
      settings.size ? std::vector{*settings.size} : std::vector<std::uint32_t>{64, 128};
  for (const std::uint32_t size : sizes)
    for (const bool folds : {false, true})
      for (const bool balls : {false, true}) add(sheet(device, settings, size, folds, balls));
  add(foldsScene(device, settings));
}

}  // namespace clothstream::bench
