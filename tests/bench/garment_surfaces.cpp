// SPDX-License-Identifier: MIT
// Suite garment: a sheet on surfaces of a real room.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "server/model/surface.h"
#include "server/simulation/collision/surface_table.h"
#include "tests/bench/garment.h"
#include "tests/bench/simulated.h"
#include "tests/model/surfaces.h"

namespace clothstream::bench {
namespace {

constexpr float kSurfaceSpacing = 0.02f;  // m, of the sheet's nodes
constexpr float kRoom = 4;                // m, sides of the floor
constexpr float kThickness = 0.005f;      // m, of the cloth
constexpr int kLanding = 144;             // ticks
// Triangles of the floor; 0: it is the top of a box.
constexpr std::uint32_t kTriangles[] = {0, 1'000, 10'000, 50'000, 100'000};

model::Scene fallingSheet(std::uint32_t size, bool onBox) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = kSurfaceSpacing * static_cast<float>(size - 1);
  // Flat, a little above the floor.
  cloth.grid.pose = {model::Vec3(0, 2 * kThickness, 0),
                     model::Quaternion(Eigen::AngleAxisf(-1.5707964f, model::Vec3::UnitX()))};
  cloth.mass = 0.01f * static_cast<float>(cloth.grid.nodeCount());
  cloth.structural = {100, 0.1f};
  cloth.shear = {50, 0.05f};
  cloth.bend = {2, 0.01f};
  cloth.damping = 0.5f;
  cloth.thickness = kThickness;
  model::Scene scene;
  scene.name = "sheet";
  scene.cloths = {cloth};
  if (onBox)
    scene.colliders.push_back({.name = "floor",
                               .shape = model::Box{model::Vec3(kRoom, 1, kRoom)},
                               .pose = {model::Vec3(0, -0.5f, 0), model::Quaternion::Identity()}});
  return scene;
}

// A flat floor of two halves side by side, as many triangles together as asked for, or a little less.
std::vector<simulation::PlacedSurface> floorOf(std::uint32_t triangles) {
  std::vector<simulation::PlacedSurface> surfaces;
  if (triangles == 0) return surfaces;
  std::uint32_t cells = 1;
  while (4 * (cells + 1) * (cells + 1) <= triangles) ++cells;
  const simulation::SharedSurface half =
      simulation::makeSurfaceTable(model::surfaceOf(model::flat(kRoom / 2, kRoom, cells)));
  for (const float side : {-1.0f, 1.0f})
    surfaces.push_back(
        {.table = half, .pose = {model::Vec3(side * kRoom / 4, 0, 0), model::Quaternion::Identity()}});
  return surfaces;
}

// Throws if the sheet does not lie on the floor.
void checkLies(const simulation::NodeState& state, const std::string& what) {
  constexpr float kRounding = 1e-5f;  // m, of coordinates below 4 m
  float low = 1, high = -1;
  for (const model::Vec3& position : state.positions) {
    low = std::min(low, position.y());
    high = std::max(high, position.y());
  }
  if (low < kThickness - kRounding || high > 2 * kThickness)
    throw std::runtime_error(
        fmt::format("{}: the sheet is between {} and {} m; on the floor it is between {} and {} m", what, low,
                    high, kThickness, 2 * kThickness));
}

}  // namespace

void addSurfaces(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const std::uint32_t size = settings.size.value_or(64);
  struct OnFloor {
    model::Scene scene;
    std::vector<simulation::PlacedSurface> floor;
    std::unique_ptr<Simulated> simulated;
    std::size_t triangles = 0;
  };
  std::vector<OnFloor> all;
  for (const std::uint32_t triangles : kTriangles) {
    OnFloor& one = all.emplace_back();
    one.scene = fallingSheet(size, triangles == 0);
    one.floor = floorOf(triangles);
    one.simulated = std::make_unique<Simulated>(
        device, one.scene,
        simulation::SimulationOptions{settings.rowsPerInvocation, settings.workgroupSize, {}});
    for (const simulation::PlacedSurface& surface : one.floor)
      one.triangles += surface.table->surface.triangles.size();
  }
  std::uint64_t tick = 0;
  const auto tickAll = [&] {
    for (OnFloor& one : all) {
      simulation::TickInputs inputs = simulation::inputsAt(one.scene, tick);
      inputs.surfaces = one.floor;
      one.simulated->tick(inputs);
    }
    ++tick;
  };
  for (int landing = 0; landing < kLanding; ++landing) tickAll();
  for (OnFloor& one : all) one.simulated->forgetTimes();
  double spent = 0;
  while (spent < static_cast<double>(all.size()) * settings.seconds || all[0].simulated->wall().count() < 21)
    spent += secondsOf(tickAll);
  const double nodeSteps = static_cast<double>(all[0].scene.nodeCount()) * all[0].scene.substeps;
  for (OnFloor& one : all) {
    const Samples& wall = one.simulated->wall();
    checkLies(one.simulated->state(),
              one.triangles == 0 ? "box" : fmt::format("{} triangles", one.triangles));
    add(Row{{"suite", "garment"},
            {"nodes", one.scene.nodeCount()},
            {"triangles", one.triangles},
            {"nsMedian", wall.median() / nodeSteps * 1e9},
            {"nsMin", wall.min() / nodeSteps * 1e9},
            {"timesBox", wall.median() / all[0].simulated->wall().median()}});
  }
}

}  // namespace clothstream::bench
