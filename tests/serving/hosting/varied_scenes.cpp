// SPDX-License-Identifier: MIT
#include "tests/serving/hosting/varied_scenes.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "server/messages/scene_message.h"
#include "server/model/mesh.h"
#include "server/model/springs.h"
#include "server/model/stability.h"
#include "tests/serving/small_scene.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::Scene;
using model::Vec3;

void stayPlain(Scene&) {}

void collideWithItself(Scene& scene) {
  model::Cloth& cloth = scene.cloths.front();
  cloth.selfCollision.emplace().radius = model::shortestSpring(cloth) / 2;
}

void letNothingPass(Scene& scene) {
  collideWithItself(scene);
  scene.cloths.front().selfCollision->nothingPasses = true;
}

void addTethers(Scene& scene) {
  scene.cloths.front().tethers.emplace();
}

// Springs that are forces would need more damping.
void addCoarseCorrection(Scene& scene) {
  const model::SolverKind kind = scene.cloths.front().solver.kind;
  if (kind != model::SolverKind::massSpring && kind != model::SolverKind::acad)
    scene.cloths.front().coarse.emplace();
}

void resistBending(Scene& scene) {
  scene.cloths.front().dihedralBending = 1e-5f;
}

void addAttachment(Scene& scene) {
  model::Attachment& rod = scene.cloths.front().attachments.emplace_back();
  rod.name = "rod";
  rod.ranges = {{.firstRow = 3, .lastRow = 8}};
}

void addShapes(Scene& scene) {
  const auto add = [&](const char* name, const model::Shape& shape, const Vec3& position) {
    model::Collider& collider = scene.colliders.emplace_back();
    collider.name = name;
    collider.shape = shape;
    collider.pose.position = position;
  };
  add("box", model::Box{Vec3(0.2f, 0.1f, 0.2f)}, {0.3f, -0.8f, 0.2f});
  add("capsule", model::Capsule{.radius = 0.05f, .length = 0.3f, .topRadius = 0.08f}, {-0.3f, -0.5f, 0.2f});
  add("hull", octahedron(), {0, -0.3f, -0.2f});
  add("floor", model::Plane{}, {0, -1, 0});
}

void addSolids(Scene& scene) {
  model::Collider ring = scene.colliders.front();
  ring.name = "ring";
  ring.shape = model::torus(0.2f, 0.06f, 12, 6);
  model::Collider block = ring;
  block.name = "block";
  block.shape = model::sampled(model::boxMesh(Vec3(0.2f, 0.2f, 0.2f)), 0.02f);
  for (model::MotionKey& key : block.motion.keys) key.position.x() += 0.3f;
  scene.colliders.push_back(ring);
  scene.colliders.push_back(block);
}

void addWinds(Scene& scene) {
  scene.environment.wind = Vec3(1, 0, 0.5f);
  scene.environment.gust = {.strength = 2, .seconds = 0.4f};
  model::SceneWind fan;
  fan.name = "fan";
  fan.pose.position = Vec3(0, -1.2f, 0.2f);
  fan.speed = 3;
  model::SceneWind vortex = fan;
  vortex.name = "vortex";
  vortex.pose.position = Vec3(0.2f, -0.5f, 0);
  vortex.kind = model::Vortex{};
  scene.winds = {fan, vortex};
}

// A disc that hangs by its centre, and a sheet that falls to the floor.
void addCloths(Scene& scene) {
  model::Cloth disc = scene.cloths.front();
  disc.name = "disc";
  disc.mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::disc(4, 0.3f)));
  disc.pins.clear();
  disc.pinnedVertices = {0};
  model::Cloth rag = scene.cloths.front();
  rag.name = "rag";
  rag.grid = {.rows = 6, .columns = 5, .width = 0.4f, .height = 0.5f, .pose = {}};
  rag.grid.pose.position = Vec3(0, 0, 0.3f);
  rag.mass = 0.03f;
  rag.pins.clear();
  scene.cloths.push_back(disc);
  scene.cloths.push_back(rag);
  model::Collider& floor = scene.colliders.emplace_back();
  floor.name = "floor";
  floor.shape = model::Plane{};
  floor.pose.position = Vec3(0, -1.3f, 0);
}

using Feature = void (*)(Scene&);
constexpr Feature kFeatures[] = {stayPlain,           collideWithItself, letNothingPass, addTethers,
                                 addCoarseCorrection, resistBending,     addAttachment,  addShapes,
                                 addSolids,           addWinds,          addCloths};

struct Rate {
  std::uint32_t ticks, substeps;
};
constexpr Rate kRates[] = {{30, 16}, {40, 12}, {60, 8}};

}  // namespace

std::vector<model::Solver> variedSolvers() {
  using enum model::SolverKind;
  std::vector<model::Solver> solvers;
  for (const model::SolverKind kind : {massSpring, xpbd, acad, acad, constraint, constraint, implicitEuler})
    solvers.emplace_back().kind = kind;
  solvers[3].acadMode = model::AcadMode::paper;
  solvers[5].path = model::ConstraintPath::assembled;
  return solvers;
}

Scene variedScene(std::size_t number) {
  const std::vector<model::Solver> solvers = variedSolvers();
  // Each round of features begins with another solver. Runge-Kutta counts as the last solver.
  const std::size_t way = (number + 2 * (number / std::size(kFeatures))) % (solvers.size() + 1);
  Scene scene = smallScene(fmt::format("scene-{}", number));
  if (way < solvers.size()) scene.cloths.front().solver = solvers[way];
  kFeatures[number % std::size(kFeatures)](scene);
  if (way == solvers.size() && scene.cloths.front().dihedralBending == 0)
    scene.integrator = model::Integrator::rungeKutta4;
  const Rate& rate = kRates[number % std::size(kRates)];
  scene.simulationRate = rate.ticks;
  scene.streamRate = number % 4 == 3 ? rate.ticks / 2 : rate.ticks;
  scene.stream.normals = number % 5 == 4 ? model::Normals::octahedral : model::Normals::none;
  scene.substeps = std::max(rate.substeps, model::stableSubsteps(scene));
  // Checked like a scene that a client has sent.
  auto valid = messages::toScene(messages::toMessage(scene));
  EXPECT_TRUE(valid) << scene.name << ": " << valid.error().text;
  return valid ? std::move(*valid) : scene;
}

}  // namespace clothstream::tests
