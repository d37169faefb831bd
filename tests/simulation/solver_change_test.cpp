// SPDX-License-Identifier: MIT
// Changes of solver in motion: no jump, and from then on the motion of the new solver.
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <gtest/gtest.h>

#include "server/model/springs.h"
#include "server/simulation/kept_stages.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::SolverKind;
using simulation::NodeState;
using simulation::StateSnapshot;

constexpr SolverKind kKinds[] = {SolverKind::massSpring, SolverKind::constraint, SolverKind::acad,
                                 SolverKind::xpbd, SolverKind::implicitEuler};

class SolverChange : public GpuTest {};

// A grid and a mesh, so soft that they stretch far under their own weight as forces.
model::Scene softScene() {
  model::Cloth sheet = calmCloth(14, 11);
  sheet.structural = {12, 0.01f};
  sheet.shear = {6, 0.01f};
  sheet.bend = {1, 0.01f};
  sheet.pins = {topRow(sheet)};
  model::Cloth disc = discCloth(5);
  disc.name = "disc";
  disc.structural = {12, 0.01f};
  disc.shear = {6, 0.01f};
  disc.bend = {1, 0.01f};
  disc.pinnedVertices = {0, 1, 2};
  return sceneOf({sheet, disc});
}

model::Scene withSolvers(model::Scene scene, SolverKind first, SolverKind second) {
  scene.cloths[0].solver.kind = first;
  scene.cloths[1].solver.kind = second;
  return scene;
}

simulation::TickInputs inputsWithBall(const model::Scene& scene) {
  const model::Pose place{model::Vec3(0, -0.15f, 0.03f), model::Quaternion::Identity()};
  return inputsOf(scene, {{model::Sphere{0.04f}, place, place, 1}});
}

float largestStrain(const model::Cloth& cloth, const NodeState& state) {
  float largest = -1;
  for (const model::SpringLink& link : model::springLinks(cloth))
    if (link.kind == model::SpringKind::structural)
      largest =
          std::max(largest, (state.positions[link.b] - state.positions[link.a]).norm() / link.restLength - 1);
  return largest;
}

// Every solver replaces every other. The state keeps every bit. The motion then has the same bits as that of
// a scene that always had the new solver and continues from the same state.
TEST_F(SolverChange, ContinuesAsIfTheClothAlwaysHadTheSolver) {
  const model::Scene scene = softScene();
  const simulation::TickInputs inputs = inputsWithBall(scene);
  Running changing(scene);
  std::optional<SolverKind> before;
  for (const SolverKind first : kKinds)
    for (const SolverKind second : kKinds) {
      SCOPED_TRACE(::testing::Message() << static_cast<int>(first) << ", " << static_cast<int>(second));
      const model::Scene changed = withSolvers(scene, first, second);
      expectGoesOnAsAlways(changing, changed, inputs, 6);
    }
}

// Stages of recent solvers are kept, so that a change to and fro makes nothing. The motion has the bits of a
// scene whose stages are new.
TEST_F(SolverChange, ToAndFroMakesNothing) {
  const model::Scene scene = softScene();
  const simulation::TickInputs inputs = inputsWithBall(scene);
  Running changing(scene);
  using enum SolverKind;
  const auto changeTo = [&](SolverKind kind, std::uint32_t iterations = 3) {
    model::Scene changed = withSolvers(scene, kind, kind);
    changed.cloths[0].solver.iterations = iterations;
    changing.setCloths(changed.cloths);
    return changed;
  };
  for (const SolverKind kind : {constraint, xpbd}) {
    changeTo(kind);
    ASSERT_TRUE(changing.tick(inputs).healthy);
  }
  EXPECT_EQ(changing.stagesMade(), 2u);
  for (const SolverKind kind : {massSpring, constraint, xpbd, massSpring, xpbd}) changeTo(kind);
  expectGoesOnAsAlways(changing, changeTo(constraint), inputs, 2);
  EXPECT_EQ(changing.stagesMade(), 2u);
  // More combinations than are kept.
  for (std::uint32_t i = 0; i <= simulation::KeptStages::kMost; ++i) changeTo(constraint, 10 + i);
  const std::uint64_t made = changing.stagesMade();
  EXPECT_EQ(made, 2 + simulation::KeptStages::kMost + 1);
  changeTo(xpbd);
  EXPECT_EQ(changing.stagesMade(), made + 1);
}

// The systems of this many nodes take more than what is kept, also those that the scene starts with.
TEST_F(SolverChange, LargeStagesAreNotKept) {
  model::Scene scene = sceneOf({calmCloth(400, 400)});
  scene.cloths[0].solver.kind = SolverKind::constraint;
  Running running(scene);
  for (const SolverKind kind : {SolverKind::massSpring, SolverKind::constraint}) {
    scene.cloths[0].solver.kind = kind;
    running.setCloths(scene.cloths);
  }
  EXPECT_EQ(running.stagesMade(), 2u);
}

// A device that has room for the stage of bending, and not for the systems of a solver. Each buffer has an
// allocation for itself.
TEST_F(SolverChange, WithoutMemoryNothingChanges) {
  const model::Scene scene = softScene();
  model::Scene bent = scene;
  bent.cloths[0].dihedralBending = 1e-5f;
  vulkan::Device many({.largestBlock = 1});
  Running plenty(scene, {}, many);
  plenty.setCloths(bent.cloths);
  vulkan::Device few({.maxAllocations = many.allocations() + 1, .largestBlock = 1});
  Running running(scene, {}, few);
  EXPECT_THROW(running.setCloths(withSolvers(bent, SolverKind::constraint, SolverKind::xpbd).cloths),
               std::runtime_error);
  EXPECT_EQ(running.stagesMade(), 0u);
  running.setCloths(bent.cloths);
  EXPECT_EQ(running.stagesMade(), 1u);
}

// Cloths whose dihedral bending alternates need tables once each.
TEST_F(SolverChange, BendingToAndFroMakesNothing) {
  const model::Scene scene = softScene();
  const simulation::TickInputs inputs = inputsWithBall(scene);
  Running changing(scene);
  std::uint64_t made = 0;
  for (int round = 0; round < 3; ++round) {
    for (const std::size_t bends : {0, 1}) {
      model::Scene changed = scene;
      changed.cloths[bends].dihedralBending = 1e-5f;
      if (round == 1)
        expectGoesOnAsAlways(changing, changed, inputs, 2);
      else
        changing.setCloths(changed.cloths);
    }
    if (round == 0) made = changing.stagesMade();
  }
  EXPECT_EQ(changing.stagesMade(), made);
}

// The number of substeps changes between ticks. The motion has the same bits as that of a simulation that was
// constructed with this number and continues from the same state.
TEST_F(SolverChange, ContinuesAsIfTheSceneAlwaysHadTheSubsteps) {
  for (const SolverKind kind : kKinds)
    for (const bool selfCollision : {false, true}) {
      SCOPED_TRACE(::testing::Message() << static_cast<int>(kind) << ", " << selfCollision);
      model::Scene scene = withSolvers(softScene(), kind, kind);
      if (selfCollision)
        for (model::Cloth& cloth : scene.cloths) cloth.selfCollision = model::SelfCollision{.radius = 0.008f};
      const simulation::TickInputs inputs = inputsWithBall(scene);
      Running changing(scene);
      for (const std::uint32_t substeps : {10u, 7u, 3u, 10u}) {
        scene.substeps = substeps;
        const simulation::StateSnapshot before = changing.save();
        Running always(scene);
        always.restore(before);
        changing.setSubsteps(substeps, scene.cloths);
        for (int tick = 0; tick < 4; ++tick)
          ASSERT_EQ(changing.tick(inputs).stateHash, always.tick(inputs).stateHash) << substeps;
      }
    }
}

// As forces the sheet hangs stretched by tens of percents. ACAD lets go of 15 % of what is beyond 10 % a
// substep, constraints of all of it: both are there within a second, and no node is thrown.
TEST_F(SolverChange, ChangesTheStrainAsTheSolverPromises) {
  model::Scene scene = softScene();
  scene.cloths.pop_back();
  scene.cloths[0].damping = 2;
  const simulation::TickInputs inputs = inputsOf(scene);
  Running running(scene);
  const auto run = [&](int ticks) {
    for (int tick = 0; tick < ticks; ++tick) ASSERT_TRUE(running.tick(inputs).healthy);
  };
  const auto changeTo = [&](SolverKind kind) {
    scene.cloths[0].solver.kind = kind;
    scene.cloths[0].solver.iterations = 100;
    running.setCloths(scene.cloths);
  };
  run(150);
  const float asForces = largestStrain(scene.cloths[0], running.state());
  ASSERT_GT(asForces, 0.3f);
  changeTo(SolverKind::acad);
  run(150);
  EXPECT_LT(largestStrain(scene.cloths[0], running.state()), 0.13f);  // 10 %, and 3 % in motion
  changeTo(SolverKind::constraint);
  run(150);
  EXPECT_LT(largestStrain(scene.cloths[0], running.state()), 0.02f);
  changeTo(SolverKind::massSpring);
  run(300);
  EXPECT_NEAR(largestStrain(scene.cloths[0], running.state()), asForces, 0.2f * asForces);
}

TEST_F(SolverChange, KeepsTheStateIfSettingsOrThicknessChange) {
  model::Scene scene = withSolvers(softScene(), SolverKind::constraint, SolverKind::acad);
  Running running(scene);
  const simulation::TickInputs inputs = inputsWithBall(scene);
  for (int tick = 0; tick < 10; ++tick) running.tick(inputs);
  const StateSnapshot kept = running.save();
  scene.cloths[0].solver.bendConstraints = true;
  scene.cloths[0].thickness = 0.02f;
  scene.cloths[1].solver.activation = 0.02f;
  running.setCloths(scene.cloths);
  EXPECT_EQ(running.save().bytes, kept.bytes);
  Running always(scene);
  always.restore(kept);
  for (int tick = 0; tick < 10; ++tick)
    ASSERT_EQ(running.tick(inputs).stateHash, always.tick(inputs).stateHash) << "tick " << tick;
  // The ball's surface and the thickness on it; the last rounding is that of 0.2 m.
  const NodeState state = running.state();
  for (std::size_t i = 0; i < scene.cloths[0].nodeCount(); ++i)
    EXPECT_GT((state.positions[i] - model::Vec3(0, -0.15f, 0.03f)).norm(), 0.06f - 1e-6f);
}

// For every solver, and for each buffer that can hold the state or the checkpoint: the motion has the same
// bits as that of a scene that always had these masses.
TEST_F(SolverChange, ContinuesAsIfTheClothAlwaysHadTheMasses) {
  const model::Scene light = softScene();
  const simulation::TickInputs inputs = inputsWithBall(light);
  for (const SolverKind kind : kKinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    model::Scene scene = withSolvers(light, kind, kind);
    Running changing(scene);
    for (int tick = 0; tick < 5; ++tick) changing.tick(inputs);
    changing.checkpoint();
    for (model::Cloth& cloth : scene.cloths) cloth.mass *= 3;
    const StateSnapshot kept = changing.save();
    changing.setCloths(scene.cloths);
    EXPECT_EQ(changing.save().bytes, kept.bytes);
    Running always(scene);
    always.restore(kept);
    for (int tick = 0; tick < 3; ++tick)
      ASSERT_EQ(changing.tick(inputs).stateHash, always.tick(inputs).stateHash) << "tick " << tick;
    changing.rollback();
    always.restore(kept);
    for (int tick = 0; tick < 3; ++tick)
      ASSERT_EQ(changing.tick(inputs).stateHash, always.tick(inputs).stateHash)
          << "rolled back, tick " << tick;
  }
}

// Balls get another size and friction, equal for both cloths or not. Tethers get another length.
TEST_F(SolverChange, ContinuesAsIfTheClothAlwaysHadSelfCollisionAndTethers) {
  model::Scene scene = softScene();
  for (model::Cloth& cloth : scene.cloths) {
    cloth.selfCollision = model::SelfCollision{.radius = 0.01f, .friction = 0.3f};
    cloth.tethers = model::Tethers{.slack = 0.02f};
  }
  const simulation::TickInputs inputs = inputsWithBall(scene);
  Running changing(scene);
  const auto change = [&](std::size_t cloth, float radius, float friction, float slack) {
    scene.cloths[cloth].selfCollision = model::SelfCollision{.radius = radius, .friction = friction};
    scene.cloths[cloth].tethers->slack = slack;
  };
  for (int round = 0; round < 3; ++round) {
    SCOPED_TRACE(round);
    if (round == 1) change(0, 0.006f, 1, 0.3f);
    if (round == 2) change(1, 0.006f, 1, 0);
    expectGoesOnAsAlways(changing, scene, inputs, 6);
  }
}

}  // namespace
}  // namespace clothstream::tests
