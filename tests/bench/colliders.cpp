// SPDX-License-Identifier: MIT
// Suite colliders: the cost of 1, 100 and 4,000 colliders, which are the hands of a hundred people.
#include <cmath>
#include <cstdint>
#include <random>

#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {
namespace {

constexpr std::size_t kHand = 40;  // capsules of one person's two hands

// A cloth with 2 cm and 10 g for each node, hung by its upper edge.
model::Scene curtain(std::uint32_t size) {
  model::Cloth cloth;
  cloth.name = "curtain";
  cloth.grid.rows = cloth.grid.columns = size;
  cloth.grid.width = cloth.grid.height = 0.02f * static_cast<float>(size - 1);
  cloth.mass = 0.01f * static_cast<float>(cloth.grid.nodeCount());
  cloth.structural = {100, 0};
  cloth.shear = {50, 0};
  cloth.bend = {10, 0};
  cloth.damping = 0.5f;
  cloth.pins = {
      {.firstRow = 0, .lastRow = 0, .rowStep = 1, .firstColumn = 0, .lastColumn = size - 1, .columnStep = 1}};
  model::Scene scene;
  scene.name = "curtain";
  scene.cloths = {cloth};
  return scene;
}

// Moving hands in a room of 6 x 2.5 x 6 m with the cloth in its middle. Some are in the cloth, most are far
// away.
std::vector<simulation::MovingCollider> hands(std::size_t count) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return model::Vec3(unit(random), unit(random), unit(random)); };
  std::vector<simulation::MovingCollider> colliders;
  model::Vec3 palm = model::Vec3::Zero(), way = model::Vec3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    if (i % kHand == 0) {
      palm = vector().cwiseProduct(model::Vec3(3, 1.25f, 3)) - model::Vec3(0, 1, 0);
      way = 0.014f * vector();  // displacement in a tick: 1 m/s
    }
    const model::Quaternion turn(Eigen::AngleAxisf(3 * unit(random), vector().normalized()));
    const model::Vec3 place = palm + 0.1f * vector();
    colliders.push_back(
        {model::Capsule{.radius = 0.008f, .length = 0.025f}, {place, turn}, {place + way, turn}, 1});
  }
  return colliders;
}

}  // namespace

Rows runColliders(vulkan::Device& device, const Settings& settings) {
  const std::uint32_t size = settings.size.value_or(128);
  const model::Scene scene = curtain(size);
  Rows rows;
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{100}, std::size_t{4000}}) {
    const simulation::TickInputs inputs{scene.environment, hands(count)};
    Simulated simulated(device, scene, {settings.rowsPerInvocation, settings.workgroupSize, {}});
    const double referenceSeconds = simulated.check(inputs);
    simulated.tick(inputs);
    simulated.restart();
    double spent = 0;
    while (spent < settings.seconds || simulated.wall().count() < 7)
      spent += secondsOf([&] { simulated.tick(inputs); });
    const double nodeSteps = static_cast<double>(size) * size * scene.substeps;
    rows.push_back({{"suite", "colliders"},
                    {"size", size},
                    {"colliders", count},
                    {"tickMsMin", simulated.wall().min() * 1e3},
                    {"tickMsMedian", simulated.wall().median() * 1e3},
                    {"tickMsP99", simulated.wall().p99() * 1e3},
                    {"nearMsMedian", count > 0 ? simulated.near().median() * 1e3 : 0},
                    {"nsMin", simulated.wall().min() / nodeSteps * 1e9},
                    {"nsMedian", simulated.wall().median() / nodeSteps * 1e9},
                    {"referenceMs", referenceSeconds * 1e3},
                    {"ticks", simulated.wall().count()},
                    {"device", device.info().name}});
  }
  return rows;
}

}  // namespace clothstream::bench
