// SPDX-License-Identifier: MIT
#include "tests/bench/hung_cloth.h"

#include <cmath>

namespace clothstream::bench {

model::Scene hungCloth(std::uint32_t size) {
  model::Cloth cloth;
  cloth.name = "hung";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = 2;
  cloth.mass = 1;
  cloth.structural = {30, 0.02f};
  cloth.shear = {15, 0.01f};
  cloth.bend = {2, 0.002f};
  cloth.damping = 0.4f;
  cloth.drag = 0.5f;
  cloth.lift = 0.3f;
  cloth.pins = {
      {.firstRow = 0, .lastRow = 0, .rowStep = 1, .firstColumn = 0, .lastColumn = size - 1, .columnStep = 3}};
  model::Scene scene;
  scene.name = "hung_cloth";
  scene.environment.wind = model::Vec3(0, 0, 2);
  scene.cloths = {cloth};
  return scene;
}

simulation::TickInputs hungClothInputs(const model::Scene& scene, std::uint64_t tick) {
  const auto centre = [&](std::uint64_t at) {
    const double seconds = static_cast<double>(at) * scene.tickSeconds();
    return model::Vec3(0, -1.2f, static_cast<float>(0.6 * std::cos(2 * seconds)));
  };
  return {scene.environment, {{model::Sphere{0.25f}, {centre(tick)}, {centre(tick + 1)}, 1}}};
}

model::Scene hungSheet(std::uint32_t size, const model::Solver& solver, std::uint32_t substeps) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 0.2f;
  cloth.damping = 1;
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = size - 1}};
  cloth.solver = solver;
  model::Scene scene;
  scene.name = "hung_sheet";
  scene.substeps = substeps;
  scene.cloths = {cloth};
  return scene;
}

model::Scene swingingSheet(std::uint32_t size, const model::Solver& solver, std::uint32_t substeps) {
  model::Scene scene = hungSheet(size, solver, substeps);
  scene.simulationRate = scene.streamRate = 60;
  model::Cloth& cloth = scene.cloths.front();
  cloth.grid.pose.orientation = model::Quaternion(std::sqrt(0.5f), -std::sqrt(0.5f), 0, 0);
  cloth.pins.front().columnStep = size - 1;
  return scene;
}

}  // namespace clothstream::bench
