// SPDX-License-Identifier: MIT
// Suite colliders: the cost of 1, 100 and 4,000 colliders, which are the hands of a hundred people, and of a
// hundred spheres that a sheet lies on.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

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

// ---- A sheet on spheres

constexpr std::uint32_t kSheet = 64;  // rows and columns
constexpr int kSpheres = 10;          // in each of two directions
constexpr int kSettling = 72;         // ticks

// A level sheet with 2 cm between nodes, free at all edges.
model::Scene sheet() {
  model::Scene scene = curtain(kSheet);
  model::Cloth& cloth = scene.cloths.front();
  cloth.pins.clear();
  cloth.structural.damping = cloth.shear.damping = 0.05f;
  cloth.grid.pose = {model::Vec3(0, 0.06f, -cloth.grid.height / 2),
                     model::Quaternion(Eigen::AngleAxisf(-1.5707964f, model::Vec3::UnitX()))};
  return scene;
}

// A bed of spheres, each of which touches the sheet that lies on them. They move up and down by `lift` a
// tick, half of them against the others.
std::vector<simulation::MovingCollider> bed(float lift, int tick) {
  const float pitch = 0.12f;  // m; the sheet reaches 9 cm beyond the outermost spheres
  std::vector<simulation::MovingCollider> colliders;
  for (int i = 0; i < kSpheres * kSpheres; ++i) {
    const auto place = [&](int at) {
      const bool up = (at + i) % 2 == 0;
      return model::Pose{
          model::Vec3(pitch * (static_cast<float>(i % kSpheres) - 0.5f * (kSpheres - 1)), up ? lift : 0,
                      pitch * (static_cast<float>(i / kSpheres) - 0.5f * (kSpheres - 1))),
          model::Quaternion::Identity()};
    };
    colliders.push_back({model::Sphere{.radius = 0.05f}, place(tick), place(tick + 1), 0.5f});
  }
  return colliders;
}

// Ticks with and without spheres alternate. Both sheets start in the state in which a sheet lies on them.
void measureBed(vulkan::Device& device, const Settings& settings, float lift, const RowSink& add) {
  const model::Scene scene = sheet();
  const simulation::SimulationOptions options{settings.rowsPerInvocation, settings.workgroupSize, {}};
  Simulated touching(device, scene, options), without(device, scene, options);
  const simulation::TickInputs none{scene.environment, {}};
  touching.check({scene.environment, bed(lift, 0)});
  touching.restart();
  int tick = 0;
  simulation::TickInputs inputs{.environment = scene.environment, .colliders = {}, .reportsContacts = true};
  const auto next = [&] {
    inputs.colliders = bed(lift, tick++);
    touching.tick(inputs);
  };
  while (tick < kSettling) next();
  std::vector<bool> touched(kSpheres * kSpheres);
  for (const simulation::ContactStatus& contact : touching.contacts()) touched[contact.collider] = true;
  if (const auto count = std::ranges::count(touched, true); count < 95)
    throw std::runtime_error(fmt::format("only {} of 100 spheres touch the sheet", count));
  inputs.reportsContacts = false;
  without.restart(touching.state());
  next();
  without.tick(none);
  touching.forgetTimes();
  without.forgetTimes();
  double spent = 0;
  while (spent < 2 * settings.seconds || without.wall().count() < 7)
    spent += secondsOf([&] { next(); }) + secondsOf([&] { without.tick(none); });
  add({{"suite", "colliders"},
       {"size", kSheet},
       {"colliders", kSpheres * kSpheres},
       {"touching", lift > 0 ? "moving" : "at rest"},
       {"tickMsMin", touching.wall().min() * 1e3},
       {"tickMsMedian", touching.wall().median() * 1e3},
       {"tickMsP99", touching.wall().p99() * 1e3},
       {"nearMsMedian", touching.near().median() * 1e3},
       {"withoutMsMin", without.wall().min() * 1e3},
       {"withoutMsMedian", without.wall().median() * 1e3},
       {"timesWithout", touching.wall().min() / without.wall().min()},
       {"ticks", touching.wall().count()},
       {"device", device.info().name}});
}

}  // namespace

void runColliders(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  const std::uint32_t size = settings.size.value_or(128);
  const model::Scene scene = curtain(size);
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
    add({{"suite", "colliders"},
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
  measureBed(device, settings, 0, add);
  measureBed(device, settings, 0.002f, add);
}

}  // namespace clothstream::bench
