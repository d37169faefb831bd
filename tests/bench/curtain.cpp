// SPDX-License-Identifier: MIT
// Suite curtain: the time of a simulated tick of a hung cloth with wind and a sphere swinging through it.
#include "tests/bench/curtain.h"

#include <cmath>

#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {

scene::Scene curtain(std::uint32_t size) {
  scene::Cloth cloth;
  cloth.name = "curtain";
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
  scene::Scene scene;
  scene.name = "curtain";
  scene.environment.wind = scene::Vec3(0, 0, 2);
  scene.cloths = {cloth};
  return scene;
}

simulation::TickInputs curtainInputs(const scene::Scene& scene, std::uint64_t tick) {
  const auto centre = [&](std::uint64_t at) {
    const double seconds = static_cast<double>(at) * scene.tickSeconds();
    return scene::Vec3(0, -1.2f, static_cast<float>(0.6 * std::cos(2 * seconds)));
  };
  return {scene.environment, {{centre(tick), centre(tick + 1), 0.25f, 1}}};
}

Rows runCurtain(vulkan::Device& device, const Settings& settings) {
  const std::uint32_t size = settings.size.value_or(64);
  const scene::Scene scene = curtain(size);
  Simulated simulated(device, scene, {settings.rowsPerInvocation, settings.workgroupSize, {}});
  std::uint64_t tick = 0;
  const auto advance = [&] { simulated.tick(curtainInputs(scene, tick++)); };
  simulated.check(curtainInputs(scene, 0));
  simulated.forgetTimes();
  double spent = 0;
  while (spent < settings.seconds || simulated.wall().count() < 100) spent += secondsOf(advance);

  const Samples& wall = simulated.wall();
  const double budget = scene.tickSeconds();
  return {{{"suite", "curtain"},
           {"size", size},
           {"nodes", size * size},
           {"substeps", scene.substeps},
           {"tickMsMin", wall.min() * 1e3},
           {"tickMsMedian", wall.median() * 1e3},
           {"tickMsP99", wall.p99() * 1e3},
           {"advanceMs", simulated.advance().median() * 1e3},
           {"budgetMs", budget * 1e3},
           {"realTime", budget / wall.p99()},
           {"ticks", wall.count()},
           {"device", device.info().name}}};
}

}  // namespace clothstream::bench
