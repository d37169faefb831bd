// SPDX-License-Identifier: MIT
// Suite price: the price of a tick, computed from the scene, and the tick that was measured.
#include "server/model/price.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/simulation/speed_meter.h"
#include "tests/bench/hung_cloth.h"
#include "tests/bench/simulated.h"
#include "tests/bench/suite.h"
#include "tests/model/solids.h"

namespace clothstream::bench {
namespace {

using enum model::SolverKind;

struct Case {
  const char* method;
  model::Solver solver{};
  model::Integrator integrator = model::Integrator::semiImplicitEuler;
  bool air = false, bending = false, selfCollision = false;
  std::uint32_t colliders = 0;
  model::Shape shape = model::Sphere{.radius = 0.3f};
  bool covers = false;  // all cloth is near each collider, and has to leave most of them
};

// A prism of radius 0.3 m and length 0.5 m. It has two faces more than `sides`.
model::Shape prism(std::uint32_t sides) {
  std::vector<model::Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> faces(2);
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    for (const double y : {-0.25, 0.25})
      vertices.emplace_back(0.3 * std::cos(angle), y, 0.3 * std::sin(angle));
    const std::uint32_t next = (i + 1) % sides;
    faces[0].push_back(2 * i);
    faces[1].insert(faces[1].begin(), 2 * i + 1);
    faces.push_back({2 * i, 2 * i + 1, 2 * next + 1, 2 * next});
  }
  return std::make_shared<const model::ConvexHull>(
      std::get<model::ConvexHull>(model::makeConvexHull(std::move(vertices), std::move(faces))));
}

// A ball of radius 0.3 m with `rings` rings of quads, which two joints move if it is `skinned`.
model::Shape ball(std::uint32_t rings, bool skinned) {
  model::ClosedMesh mesh = *model::ballMesh(0.3f, rings);
  if (!skinned) return std::make_shared<const model::ClosedMesh>(std::move(mesh));
  const auto at = [](float y) { return model::Pose{model::Vec3(0, y, 0), model::Quaternion::Identity()}; };
  model::Skin skin;
  skin.joints = {{"root", std::nullopt, at(0)}, {"top", 0, at(0.1f)}};
  for (const model::Vec3& vertex : mesh.vertices) {
    const float top = std::clamp(0.5f + vertex.y(), 0.0f, 1.0f);
    skin.vertices.push_back({{0, 1, 0, 0}, {1 - top, top, 0, 0}});
  }
  skin.keys = {{0, {at(0), at(0.1f)}}, {0.5f, {at(0), at(0.12f)}}, {1, {at(0), at(0.1f)}}};
  mesh.skin = std::move(skin);
  return std::make_shared<const model::ClosedMesh>(std::move(mesh));
}

// The same with sampled distances, with cells of 2 cm.
model::Shape sampledBall(std::uint32_t rings) {
  return model::sampled(model::ballMesh(0.3f, rings), 0.02f);
}

// Solvers that may end early never do: the tolerance is 0.
std::vector<Case> cases() {
  std::vector<Case> all = {
      {"mass_spring"},
      {.method = "runge_kutta", .integrator = model::Integrator::rungeKutta4},
      {.method = "air", .air = true},
      {.method = "dihedral", .bending = true},
      {.method = "self_collision", .selfCollision = true},
      {.method = "1 collider", .colliders = 1},
      {.method = "8 colliders", .colliders = 8},
      {.method = "64 colliders", .colliders = 64},
      {.method = "8 capsules", .colliders = 8, .shape = model::Capsule{.radius = 0.3f}},
      {.method = "8 boxes", .colliders = 8, .shape = model::Box{.size = {0.5, 0.5, 0.5}}},
      {.method = "60 large boxes",
       .colliders = 60,
       .shape = model::Box{.size = {2, 2, 0.1f}},
       .covers = true},
      {.method = "8 hulls of 32 faces", .colliders = 8, .shape = prism(30)},
      {.method = "8 hulls of 128 faces", .colliders = 8, .shape = prism(126)},
      {.method = "mesh of 1,848 triangles", .colliders = 1, .shape = ball(22, false)},
      {.method = "mesh of 19,320 triangles", .colliders = 1, .shape = ball(70, false)},
      {.method = "sampled mesh of 1,848 triangles", .colliders = 1, .shape = sampledBall(22)},
      {.method = "sampled mesh of 19,320 triangles", .colliders = 1, .shape = sampledBall(70)},
      {.method = "skin of 1,848 triangles", .colliders = 1, .shape = ball(22, true)},
      {.method = "skin of 19,320 triangles", .colliders = 1, .shape = ball(70, true)}};
  const auto solver = [&](const char* method, model::SolverKind kind, std::uint32_t iterations) {
    all.push_back({.method = method});
    all.back().solver.kind = kind;
    all.back().solver.iterations = iterations;
    all.back().solver.tolerance = 0;
  };
  for (const std::uint32_t iterations : {5u, 50u}) {
    solver("constraint", constraint, iterations);
    solver("acad", acad, iterations);
    solver("implicit_euler", implicitEuler, iterations);
    solver("assembled", constraint, iterations);
    all.back().solver.path = model::ConstraintPath::assembled;
  }
  for (const std::uint32_t iterations : {1u, 10u}) solver("xpbd", xpbd, iterations);
  return all;
}

model::Scene sceneOf(const Case& experiment, std::uint32_t size) {
  model::Scene scene = hungSheet(size, experiment.solver, 8);
  model::Cloth& cloth = scene.cloths.front();
  const double h = scene.substepSeconds();
  const auto bearable = static_cast<float>(0.1 * double{cloth.nodeMass()} / (h * h));
  cloth.structural.stiffness = bearable;
  cloth.shear.stiffness = bearable / 2;
  cloth.bend.stiffness = bearable / 10;
  scene.integrator = experiment.integrator;
  scene.environment.airDensity = experiment.air ? 1.2f : 0;
  cloth.drag = cloth.lift = experiment.air ? 1.0f : 0;
  cloth.dihedralBending = experiment.bending ? 1e-9f : 0;
  if (experiment.selfCollision)
    cloth.selfCollision = model::SelfCollision{.radius = 0.4f / static_cast<float>(size)};
  for (std::uint32_t i = 0; i < experiment.colliders; ++i) {
    model::Collider collider;
    collider.name = std::to_string(i);
    collider.shape = experiment.shape;
    collider.pose.position = model::Vec3(0, -0.5f, 0.3f);
    if (experiment.covers) collider.pose.position.z() = 0.001f * static_cast<float>(i + 1);
    scene.colliders.push_back(collider);
  }
  return scene;
}

}  // namespace

void runPrice(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  std::vector<std::uint32_t> sizes = {16, 32, 64, 128, 256};
  if (settings.size) sizes = {*settings.size};
  simulation::SpeedMeter meter(device);
  for (const std::uint32_t size : sizes)
    for (const Case& experiment : cases()) {
      const model::Scene scene = sceneOf(experiment, size);
      const std::uint64_t before = device.allocatedBytes();
      Simulated simulated(device, scene, {});
      const std::uint64_t bytes = device.allocatedBytes() - before;
      const model::DeviceSpeed speed = meter.measure();
      const int ticks = size < 128 ? 10 : 4;
      for (int tick = -1; tick < ticks; ++tick) {
        if (tick == 0) simulated.forgetTimes();
        simulated.tick(simulation::inputsAt(scene, static_cast<std::uint64_t>(tick + 1)));
      }
      const double measured = simulated.wall().median();
      const model::PriceModel model(scene);
      const double price = model.work(scene).seconds(speed);
      add({{"suite", "price"},
           {"method", experiment.method},
           {"size", size},
           {"iterations", experiment.solver.iterations},
           {"node_step_ns", speed.nodeStepSeconds * 1e9},
           {"dispatch_us", speed.dispatchSeconds * 1e6},
           {"price_ms", price * 1e3},
           {"tick_ms", measured * 1e3},
           {"price_over_tick", price / measured},
           {"price_mb", model.bytes(scene) / 1e6},
           {"device_mb", static_cast<double>(bytes) / 1e6}});
    }
}

}  // namespace clothstream::bench
