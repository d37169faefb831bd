// SPDX-License-Identifier: MIT
#include "tests/mechanics/ways.h"

#include <cctype>
#include <cmath>
#include <stdexcept>

namespace clothstream::mechanics {
namespace {

model::Solver plain(model::SolverKind kind) {
  model::Solver solver;
  solver.kind = kind;
  return solver;
}

bool hasForces(const model::Solver& solver) {
  return solver.kind == model::SolverKind::massSpring || solver.kind == model::SolverKind::acad;
}

}  // namespace

std::vector<Way> ways() {
  model::Solver sweeps = plain(model::SolverKind::xpbd);
  sweeps.iterations = 4;
  return {{"`massSpring`", plain(model::SolverKind::massSpring)},
          {"`acad`", plain(model::SolverKind::acad), false},
          {"`constraint`", plain(model::SolverKind::constraint), true, false},
          {"`implicitEuler`", plain(model::SolverKind::implicitEuler), false, false},
          {"`xpbd`", plain(model::SolverKind::xpbd)},
          {"`xpbd`, 4 sweeps", sweeps}};
}

Way wayNamed(std::string_view name) {
  for (const Way& way : ways())
    if (way.name == name) return way;
  throw std::out_of_range("no way is named " + std::string(name));
}

std::string lettersOf(const std::string& name) {
  std::string letters;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) letters += c;
  return letters;
}

model::Cloth clothOf(const Way& way) {
  const bool forces = hasForces(way.solver);
  model::Cloth cloth;
  cloth.name = "cloth";
  cloth.grid = {.rows = 8, .columns = 8, .width = 0.4f, .height = 0.4f};
  cloth.grid.pose.orientation = tests::turned(50, model::Vec3::UnitX());
  cloth.mass = 0.05f;
  cloth.structural = {forces ? 8.0f : 500.0f, 0.001f};
  cloth.shear = {cloth.structural.stiffness / 4, 0.001f};
  // Bend springs stay forces in `constraint`.
  const bool softBend = way.solver.kind == model::SolverKind::constraint;
  cloth.bend = {softBend ? 1 : cloth.structural.stiffness / 10, 0.0005f};
  cloth.damping = cloth.drag = cloth.lift = 0;
  cloth.solver = way.solver;
  return cloth;
}

model::Scene sceneOf(const model::Cloth& cloth) {
  model::Scene scene = tests::sceneOf({cloth});
  scene.simulationRate = scene.streamRate = 18;
  scene.substeps = hasForces(cloth.solver) ? 16 : cloth.solver.kind == model::SolverKind::xpbd ? 4 : 8;
  return scene;
}

simulation::NodeState after(tests::Running& running, const model::Scene& scene, double seconds) {
  const int ticks = static_cast<int>(std::lround(seconds * scene.simulationRate));
  for (int tick = 0; tick < ticks; ++tick) EXPECT_TRUE(running.tick(tests::inputsOf(scene)).healthy);
  return running.state();
}

}  // namespace clothstream::mechanics
