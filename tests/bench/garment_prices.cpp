// SPDX-License-Identifier: MIT
// Suite garment: what limits of clothes, gas and surfaces of a real room add to a tick, and their price.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "server/model/cloth_skin.h"
#include "server/model/mesh.h"
#include "server/model/price.h"
#include "server/model/surface.h"
#include "server/simulation/collision/surface_table.h"
#include "server/simulation/speed_meter.h"
#include "tests/bench/garment.h"
#include "tests/bench/simulated.h"
#include "tests/model/meshes.h"
#include "tests/model/solids.h"
#include "tests/model/surfaces.h"

namespace clothstream::bench {
namespace {

constexpr int kPriceSettling = 36, kLeastPriceTicks = 21;
constexpr float kSheetSpacing = 0.01f;  // m

using Surfaces = std::vector<simulation::PlacedSurface>;

// A scene that differs from the first one of its group in one thing.
struct PricedScene {
  std::string name;
  model::Scene scene;
  Surfaces surfaces = {};
  std::unique_ptr<Simulated> simulated = nullptr;
};

// A sheet that stays where it is, without gravity, flat at the height `y`.
model::Scene restingSheet(std::uint32_t size, float y) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = kSheetSpacing * static_cast<float>(size - 1);
  cloth.grid.pose = {model::Vec3(0, y, 0),
                     model::Quaternion(Eigen::AngleAxisf(-1.5707964f, model::Vec3::UnitX()))};
  cloth.mass = 0.01f * static_cast<float>(cloth.grid.nodeCount());
  cloth.structural = {100, 0.1f};
  cloth.shear = {50, 0.05f};
  cloth.bend = {2, 0.01f};
  model::Scene scene;
  scene.name = "sheet";
  scene.environment.gravity = model::Vec3::Zero();
  scene.environment.airDensity = 0;
  scene.cloths = {cloth};
  return scene;
}

// The inside of a room of 4 x 4 x 4 m around the origin: one mesh of `triangles`, or a little fewer.
simulation::SharedSurface insideOfRoom(std::uint32_t triangles) {
  std::uint32_t cells = 1;
  while (12 * (cells + 1) * (cells + 1) <= triangles) ++cells;
  const model::Triangles side = model::flat(4, 4, cells);
  const float quarter = 1.5707964f;
  const model::Quaternion turns[] = {model::Quaternion::Identity(),
                                     model::Quaternion(Eigen::AngleAxisf(2 * quarter, model::Vec3::UnitX())),
                                     model::Quaternion(Eigen::AngleAxisf(quarter, model::Vec3::UnitX())),
                                     model::Quaternion(Eigen::AngleAxisf(-quarter, model::Vec3::UnitX())),
                                     model::Quaternion(Eigen::AngleAxisf(quarter, model::Vec3::UnitZ())),
                                     model::Quaternion(Eigen::AngleAxisf(-quarter, model::Vec3::UnitZ()))};
  model::Triangles room;
  for (const model::Quaternion& turn : turns) {
    const auto first = static_cast<std::uint32_t>(room.vertices.size());
    for (const model::Vec3& vertex : side.vertices)
      room.vertices.push_back(turn * (vertex - 2 * model::Vec3::UnitY()));
    for (const model::TriangleCorners& triangle : side.triangles)
      room.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
  }
  return simulation::makeSurfaceTable(model::surfaceOf(room));
}

void tickInTurn(std::vector<PricedScene>& all, std::uint64_t tick) {
  for (PricedScene& one : all) {
    simulation::TickInputs inputs = simulation::inputsAt(one.scene, tick);
    inputs.surfaces = one.surfaces;
    one.simulated->tick(inputs);
  }
}

// Seconds of a tick by price.
double priceOf(const PricedScene& one, const model::DeviceSpeed& speed) {
  const model::PriceModel prices(one.scene);
  model::Work work = prices.work(one.scene);
  double searches = 0, costliest = 0;
  for (const simulation::PlacedSurface& placed : one.surfaces) {
    searches += model::kSurfaceTestWork;
    costliest = std::max(costliest, model::surfaceWork(placed.table->surface));
  }
  work += prices.surfacesWork(one.scene, searches + costliest);
  return work.seconds(speed);
}

// Ticks of all scenes in turn, with the speed of the device in between. The first scene is what the others
// add to.
void addGroup(vulkan::Device& device, const Settings& settings, const RowSink& add,
              std::vector<PricedScene> all) {
  simulation::SpeedMeter meter(device);
  for (PricedScene& one : all)
    one.simulated = std::make_unique<Simulated>(
        device, one.scene,
        simulation::SimulationOptions{settings.rowsPerInvocation, settings.workgroupSize, {}});
  std::uint64_t tick = 0;
  for (int settling = 0; settling < kPriceSettling; ++settling) tickInTurn(all, tick++);
  for (PricedScene& one : all) one.simulated->forgetTimes();
  Samples nodeStep, dispatch;
  model::DeviceSpeed speed;
  double spent = 0;
  while (spent < settings.seconds * static_cast<double>(all.size()) ||
         all[0].simulated->wall().count() < kLeastPriceTicks) {
    speed = meter.measure();
    nodeStep.add(speed.nodeStepSeconds);
    dispatch.add(speed.dispatchSeconds);
    spent += secondsOf([&] { tickInTurn(all, tick++); });
  }
  speed.nodeStepSeconds = nodeStep.median();
  speed.dispatchSeconds = dispatch.median();
  const double baseTick = all[0].simulated->wall().median(), basePrice = priceOf(all[0], speed);
  for (const PricedScene& one : std::span(all).subspan(1)) {
    const double tickSeconds = one.simulated->wall().median(), priceSeconds = priceOf(one, speed);
    const double nodeSteps = static_cast<double>(one.scene.nodeCount()) * one.scene.substeps;
    add(Row{{"suite", "garment"},
            {"priced", one.name},
            {"nodes", one.scene.nodeCount()},
            {"addedNs", (tickSeconds - baseTick) / nodeSteps * 1e9},
            {"addedNodeSteps", (tickSeconds - baseTick) / nodeSteps / speed.nodeStepSeconds},
            {"pricedNodeSteps", (priceSeconds - basePrice) / nodeSteps / speed.nodeStepSeconds},
            {"priceOverMeasured", (priceSeconds - basePrice) / (tickSeconds - baseTick)},
            {"tickMs", tickSeconds * 1e3},
            {"wholePriceOverTick", priceSeconds / tickSeconds},
            {"nodeStepNs", speed.nodeStepSeconds * 1e9},
            {"dispatchUs", speed.dispatchSeconds * 1e6}});
  }
}

// On the floor of a room, where all nodes are near; in its middle, where none is; beside its box.
std::vector<PricedScene> onSurfaces(std::uint32_t size, std::uint32_t triangles) {
  const simulation::SharedSurface room = insideOfRoom(triangles);
  const std::size_t count = room->surface.triangles.size();
  const auto standing = [&](const model::Vec3& at) {
    return Surfaces{{.table = room, .pose = {at, model::Quaternion::Identity()}}};
  };
  const float half = 2;
  std::vector<PricedScene> all;
  all.push_back({.name = "sheet", .scene = restingSheet(size, 0.004f)});
  all.push_back({.name = fmt::format("{} triangles, all nodes near", count),
                 .scene = restingSheet(size, 0.004f),
                 .surfaces = standing({0, half, 0})});
  all.push_back({.name = fmt::format("{} triangles, in the box", count),
                 .scene = restingSheet(size, 0.004f),
                 .surfaces = standing({0, 0, 0})});
  all.push_back({.name = fmt::format("{} triangles, beside the box", count),
                 .scene = restingSheet(size, 0.004f),
                 .surfaces = standing({0, 10, 0})});
  return all;
}

// A rod of two joints far away from the cloth.
model::Collider farRod() {
  model::ClosedMesh mesh = *model::rodMesh(0.03f, 0.4f, 8, 12);
  for (model::Vec3& vertex : mesh.vertices) vertex.y() -= 10;
  mesh.skin =
      model::Skin{.joints = {{"root", std::nullopt, {}}, {"elbow", 0, {}}}, .vertices = {}, .keys = {}};
  for (const model::Vec3& vertex : mesh.vertices) {
    const float bent = std::clamp(vertex.x() / 0.1f + 0.5f, 0.0f, 1.0f);
    mesh.skin->vertices.push_back({{0, 1, 0, 0}, {1 - bent, bent, 0, 0}});
  }
  return {.name = "rod", .shape = std::make_shared<const model::ClosedMesh>(std::move(mesh))};
}

// A sheet whose nodes have limits.
model::Scene limitedSheet(std::uint32_t size, const model::SkinLimits& limits) {
  model::Scene scene = restingSheet(size, 0);
  scene.colliders.push_back(farRod());
  auto skin = std::make_shared<model::ClothSkin>();
  skin->collider = "rod";
  for (const model::Vec3& place : model::restPositions(scene.cloths[0])) {
    const float bent = std::clamp(place.x() / 0.1f + 0.5f, 0.0f, 1.0f);
    skin->joints.push_back({{0, 1, 0, 0}, {1 - bent, bent, 0, 0}});
    skin->limits.push_back(limits);
  }
  model::complete(*skin, scene.cloths[0], scene.colliders[0]);
  scene.cloths[0].skin = std::move(skin);
  return scene;
}

std::vector<PricedScene> withLimits(std::uint32_t size) {
  std::vector<PricedScene> all;
  all.push_back({.name = "sheet and rod", .scene = restingSheet(size, 0)});
  all.back().scene.colliders.push_back(farRod());
  all.push_back({.name = "skin without limits", .scene = limitedSheet(size, {})});
  all.push_back({.name = "skin with maxDistance", .scene = limitedSheet(size, {.maxDistance = 0.02f})});
  all.push_back({.name = "skin with maxDistance and backstop",
                 .scene = limitedSheet(size, {.maxDistance = 0.02f, .backstopRadius = 1})});
  all.push_back({.name = "skin that follows exactly", .scene = limitedSheet(size, {.maxDistance = 0})});
  return all;
}

// A ball with about size x size nodes.
std::vector<PricedScene> withGas(std::uint32_t size) {
  const auto parts = static_cast<std::uint32_t>(std::lround(size / std::sqrt(10.0)));
  const auto ball = [&](float pressure) {
    model::Scene scene = restingSheet(2, 0);
    model::Cloth& cloth = scene.cloths[0];
    cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::icosphere(parts, 0.5f)));
    cloth.mass = 0.01f * static_cast<float>(cloth.nodeCount());
    cloth.pressure = pressure;
    return scene;
  };
  std::vector<PricedScene> all;
  all.push_back({.name = "ball", .scene = ball(0)});
  all.push_back({.name = "gas", .scene = ball(100)});
  return all;
}

}  // namespace

void addPrices(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const std::vector<std::uint32_t> sizes =
      settings.size ? std::vector{*settings.size} : std::vector<std::uint32_t>{32, 64, 128};
  for (const std::uint32_t size : sizes) {
    addGroup(device, settings, add, withLimits(size));
    addGroup(device, settings, add, withGas(size));
    for (const std::uint32_t triangles : {12u, 1'000u, 10'000u, 50'000u})
      addGroup(device, settings, add, onSurfaces(size, triangles));
  }
}

}  // namespace clothstream::bench
