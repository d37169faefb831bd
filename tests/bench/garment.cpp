// SPDX-License-Identifier: MIT
// Suite garment: cost of a substep of cloth that follows joints.
#include "tests/bench/garment.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "server/model/cloth_skin.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"
#include "tests/model/solids.h"

namespace clothstream::bench {
namespace {

constexpr float kSpacing = 0.02f;      // m
constexpr float kMaxDistance = 0.02f;  // m
// Excess of a distance by the rounding of places and by that of the limit.
constexpr double kMostExcess = 1e-5;  // m

enum class Limits { none, distance, backstop };

const char* nameOf(Limits limits) {
  switch (limits) {
    case Limits::none:
      return "not skinned";
    case Limits::distance:
      return "max distance";
    case Limits::backstop:
      break;
  }
  return "max distance and backstop";
}

// A rod of two joints far below the sheet, so that nothing touches it.
model::Solid rod() {
  model::ClosedMesh mesh = *model::rodMesh(0.03f, 0.4f, 8, 12);
  for (model::Vec3& vertex : mesh.vertices) vertex.y() -= 10;
  model::Skin skin{.joints = {{"root", std::nullopt, {}}, {"elbow", 0, {}}}, .vertices = {}, .keys = {}};
  for (const model::Vec3& vertex : mesh.vertices) {
    const float bent = std::clamp(vertex.x() / 0.1f + 0.5f, 0.0f, 1.0f);
    skin.vertices.push_back({{0, 1, 0, 0}, {1 - bent, bent, 0, 0}});
  }
  mesh.skin = skin;
  return std::make_shared<const model::ClosedMesh>(std::move(mesh));
}

// A sheet that hangs by its first row, and whose other nodes have limits.
model::Scene sheetScene(std::uint32_t size, model::SolverKind solver, Limits limits) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = kSpacing * static_cast<float>(size - 1);
  cloth.mass = 0.01f * static_cast<float>(cloth.grid.nodeCount());
  cloth.structural = {100, 0.1f};
  cloth.shear = {50, 0.05f};
  cloth.bend = {2, 0.01f};
  cloth.damping = 0.5f;
  cloth.solver.kind = solver;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = size - 1}};
  const model::Collider collider{.name = "rod", .shape = rod()};
  if (limits != Limits::none) {
    auto skin = std::make_shared<model::ClothSkin>();
    skin->collider = "rod";
    for (const model::Vec3& place : model::restPositions(cloth)) {
      const float bent = std::clamp(place.x() / 0.1f + 0.5f, 0.0f, 1.0f);
      skin->joints.push_back({{0, 1, 0, 0}, {1 - bent, bent, 0, 0}});
      skin->limits.push_back({.maxDistance = kMaxDistance,
                              .backstopDistance = 0.001f,
                              .backstopRadius = limits == Limits::backstop ? 1.0f : 0.0f});
    }
    model::complete(*skin, cloth, collider);
    cloth.skin = skin;
  }
  model::Scene scene;
  scene.name = "sheet";
  scene.cloths = {cloth};
  scene.colliders.push_back(collider);
  return scene;
}

// Throws if a node is farther from its skinned place than it may be. The joints rest.
void checkDistances(const model::Scene& scene, const simulation::NodeState& state) {
  const model::Cloth& cloth = scene.cloths[0];
  if (!cloth.skin) return;
  const std::vector<model::Vec3> places = model::restPositions(cloth);
  double farthest = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    farthest = std::max(farthest, (state.positions[i].cast<double>() - places[i].cast<double>()).norm());
  if (farthest > double{kMaxDistance} + kMostExcess)
    throw std::runtime_error(
        fmt::format("a node is {} m from its skinned place; {} m are allowed", farthest, kMaxDistance));
  if (farthest < 0.9 * double{kMaxDistance})
    throw std::runtime_error("no node reaches its largest distance, so that the limits are not measured");
}

// The same sheet with each kind of limits, tick by tick in turn.
void addSheets(vulkan::Device& device, const Settings& settings, const RowSink& add, std::uint32_t size,
               model::SolverKind solver) {
  constexpr Limits kAll[] = {Limits::none, Limits::distance, Limits::backstop};
  std::vector<model::Scene> scenes;
  std::vector<std::unique_ptr<Simulated>> running;
  for (const Limits limits : kAll) {
    scenes.push_back(sheetScene(size, solver, limits));
    running.push_back(std::make_unique<Simulated>(
        device, scenes.back(),
        simulation::SimulationOptions{settings.rowsPerInvocation, settings.workgroupSize, {}}));
  }
  std::uint64_t tick = 0;
  const auto tickAll = [&] {
    for (std::size_t i = 0; i < running.size(); ++i) running[i]->tick(simulation::inputsAt(scenes[i], tick));
    ++tick;
  };
  for (int settling = 0; settling < 36; ++settling) tickAll();
  for (const auto& simulated : running) simulated->forgetTimes();
  double spent = 0;
  while (spent < 3 * settings.seconds || running[0]->wall().count() < 21) spent += secondsOf(tickAll);
  const double nodeSteps = static_cast<double>(scenes[0].nodeCount()) * scenes[0].substeps;
  for (std::size_t i = 0; i < running.size(); ++i) {
    checkDistances(scenes[i], running[i]->state());
    add(Row{{"suite", "garment"},
            {"solver", solver == model::SolverKind::xpbd ? "xpbd" : "massSpring"},
            {"nodes", scenes[i].nodeCount()},
            {"limits", nameOf(kAll[i])},
            {"nsMedian", running[i]->wall().median() / nodeSteps * 1e9},
            {"nsMin", running[i]->wall().min() / nodeSteps * 1e9},
            {"timesNotSkinned", running[i]->wall().median() / running[0]->wall().median()}});
  }
}

}  // namespace

void runGarment(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const std::vector<std::uint32_t> sizes =
      settings.size ? std::vector{*settings.size} : std::vector<std::uint32_t>{64, 128};
  for (const std::uint32_t size : sizes)
    for (const model::SolverKind solver : {model::SolverKind::massSpring, model::SolverKind::xpbd})
      addSheets(device, settings, add, size, solver);
  addSurfaces(device, settings, add);
  addFigures(device, settings, add);
  addPrices(device, settings, add);
}

}  // namespace clothstream::bench
