// SPDX-License-Identifier: MIT
// Cloth against surfaces of the real room.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "server/simulation/collision/surface_stage.h"
#include "server/simulation/collision/surface_table.h"
#include "tests/model/surfaces.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::surfaceOf;
using simulation::NodeState;
using simulation::PlacedSurface;
using simulation::TickInputs;

class SurfaceCollision : public GpuTest {};

simulation::SharedSurface tableOf(const model::Triangles& triangles) {
  return simulation::makeSurfaceTable(surfaceOf(triangles));
}

TickInputs inputsWith(const model::Scene& scene, std::vector<PlacedSurface> surfaces) {
  TickInputs inputs = inputsOf(scene);
  inputs.surfaces = std::move(surfaces);
  return inputs;
}

// One substep in a tick, without gravity: only contacts change the way of loose nodes.
model::Scene looseScene(std::uint32_t rows, std::uint32_t columns) {
  model::Scene scene = sceneOf({looseCloth(rows, columns)});
  scene.substeps = 1;
  scene.simulationRate = 720;
  scene.environment.gravity = model::Vec3::Zero();
  return scene;
}

// The cloth lies flat at this height, centred on the origin.
model::Cloth lying(model::Cloth cloth, float height) {
  cloth.grid.pose.orientation = turned(-90, model::Vec3::UnitX());
  cloth.grid.pose.position = model::Vec3(0, height, -cloth.grid.height / 2);
  return cloth;
}

float lowestOf(const NodeState& state) {
  float lowest = 1e9f;
  for (const model::Vec3& position : state.positions) lowest = std::min(lowest, position.y());
  return lowest;
}

// Nodes everywhere around surfaces with one side and with two, whose poses are turned, against the reference.
// Crossings from both sides, contacts in corners, at rims and behind are among them.
TEST_F(SurfaceCollision, NodesTouchSurfacesAsInTheReference) {
  const model::Triangles rooms[] = {model::flat(0.3f, 0.2f, 3), model::corner(),
                                    model::terrain(0.5f, 0.5f, 12, model::waves)};
  for (std::size_t kind = 0; kind < std::size(rooms); ++kind)
    for (const bool twoSided : {false, true}) {
      model::Scene scene = looseScene(33, 33);
      std::mt19937 random(17);
      NodeState start = randomState(scene, random, 0, 8);
      std::uniform_real_distribution<float> unit(-0.2f, 0.2f);
      for (model::Vec3& position : start.positions)
        position = model::Vec3(unit(random), unit(random), unit(random));
      const model::Pose pose{model::Vec3(0.01f, 0.02f, 0), turned(25, model::Vec3(1, 0.3f, 0.2f))};
      const model::Pose other{model::Vec3(0, -0.05f, 0.03f), turned(-70, model::Vec3(0.1f, 1, 0.4f))};
      const TickInputs inputs = inputsWith(scene, {{tableOf(rooms[kind]), pose, twoSided, 1},
                                                   {tableOf(model::flat(0.2f, 0.2f)), other, true, 0.5f}});
      Running running(scene);
      running.restore(start);
      EXPECT_TRUE(running.tick(inputs).healthy);
      reference::ReferenceSimulation reference(scene);
      setState(reference, start);
      reference.tick(referenceInputs(inputs));
      const NodeState after = running.state();
      // Each of up to four contacts has the rounding of some forty products of lengths below 1 m. The normal
      // of one with the nearest point has that error divided by the distance, 0.1 mm at least. It acts over
      // the thickness at most, and on speeds of up to 14 m/s.
      const double rounding = 40 * kRounding, turn = rounding / 1e-4;
      EXPECT_LT(largestDistance(after, reference), 4 * (rounding + turn * scene.cloths[0].thickness))
          << kind << twoSided;
      EXPECT_LT(largestSpeedDifference(after, reference), 4 * turn * 14) << kind << twoSided;
      std::size_t moved = 0;
      for (std::size_t i = 0; i < start.positions.size(); ++i)
        moved += (after.positions[i] - start.positions[i] - start.velocities[i] / 720).norm() > 1e-4f;
      EXPECT_GT(moved, 50u) << kind << twoSided;
    }
}

TEST_F(SurfaceCollision, ClothRestsOnADeskAndHangsOverItsEdge) {
  for (const bool twoSided : {false, true}) {
    model::Cloth cloth = lying(calmCloth(21, 21), 0.02f);
    cloth.thickness = 0.004f;
    cloth.friction = 1;
    cloth.damping = 1;
    const model::Scene scene = sceneOf({cloth});
    // The desk ends at 0.08 m, so that 30 % of the cloth hang down. Friction can hold half of it.
    const model::Pose pose{model::Vec3(-0.27f, 0, 0), model::Quaternion::Identity()};
    const TickInputs inputs = inputsWith(scene, {{tableOf(model::flat(0.7f, 1, 4)), pose, twoSided, 1}});
    Running running(scene);
    for (int tick = 0; tick < 144; ++tick) ASSERT_TRUE(running.tick(inputs).healthy);
    const NodeState state = running.state();
    std::size_t resting = 0, hanging = 0;
    for (const model::Vec3& position : state.positions) {
      if (position.x() < 0.04f) {
        // A substep's way of falling is the most that a resting node is above the thickness.
        EXPECT_GE(position.y(), cloth.thickness - 1e-5f);
        EXPECT_LE(position.y(), cloth.thickness + 0.01f);
        ++resting;
      } else if (position.y() < 0) {
        ++hanging;
      }
    }
    EXPECT_GT(resting, 200u) << twoSided;
    EXPECT_GT(hanging, 20u) << twoSided;
    EXPECT_LT(lowestOf(state), -0.03f);
  }
}

// Nodes at up to 100 m/s, which is 14 cm in a substep, from above and below waves of 4 cm.
TEST_F(SurfaceCollision, NothingPassesAtOneHundredMetresPerSecond) {
  model::Scene scene = looseScene(65, 65);
  std::mt19937 random(5);
  NodeState start = randomState(scene, random, 0, 100);
  std::uniform_real_distribution<float> unit(-0.4f, 0.4f);
  for (std::size_t i = 0; i < start.positions.size(); ++i) {
    const float x = unit(random), z = unit(random), away = 0.005f + 0.1f * std::abs(unit(random));
    start.positions[i] = model::Vec3(x, model::waves(x, z) + (i % 2 == 0 ? away : -away), z);
  }
  // Four times larger than the nodes' ways, so that none comes around the rim.
  const auto reference =
      std::make_shared<const model::Surface>(surfaceOf(model::terrain(4, 4, 64, model::waves)));
  const TickInputs inputs =
      inputsWith(scene, {{tableOf(model::terrain(4, 4, 64, model::waves)), {}, true, 1}});
  Running running(scene);
  running.restore(start);
  NodeState before = start;
  for (int tick = 0; tick < 5; ++tick) {
    ASSERT_TRUE(running.tick(inputs).healthy);
    const NodeState after = running.state();
    const reference::PlacedSurface placed{.surface = reference, .twoSided = true};
    for (std::size_t i = 0; i < after.positions.size(); i += 37)  // the oracle tests 8,192 triangles
      EXPECT_FALSE(reference::crossesSurfaces(std::span(&placed, 1), before.positions[i].cast<double>(),
                                              after.positions[i].cast<double>()))
          << i;
    before = after;
  }
  std::size_t stopped = 0;
  for (std::size_t i = 0; i < before.positions.size(); ++i)
    stopped += (before.velocities[i] - start.velocities[i]).norm() > 1;
  EXPECT_GT(stopped, 1000u);
}

TEST_F(SurfaceCollision, ASurfaceWithOneSideLetsNodesInFromBehindOnly) {
  model::Scene scene = looseScene(2, 2);
  NodeState start = simulation::unpack(Running(scene).save());
  // One from above, one from below, one that stands 1 cm below, and one that stands deeper than is pushed.
  start.positions = {model::Vec3(0, 0.01f, 0), model::Vec3(0.1f, -0.05f, 0), model::Vec3(0.2f, -0.01f, 0),
                     model::Vec3(-0.1f, -0.04f, 0)};
  start.velocities = {model::Vec3(0, -40, 0), model::Vec3(0, 60, 0), model::Vec3::Zero(),
                      model::Vec3::Zero()};
  const TickInputs inputs = inputsWith(scene, {{tableOf(model::flat(1, 1, 2)), {}, false, 1}});
  Running running(scene);
  running.restore(start);
  running.tick(inputs);
  const NodeState once = running.state();
  const float thickness = scene.cloths[0].thickness;
  EXPECT_NEAR(once.positions[0].y(), thickness, 1e-6);
  EXPECT_GT(once.positions[1].y(), 0.03f);
  // Pushed at 3 m/s.
  EXPECT_NEAR(once.positions[2].y(), -0.01f + model::kSurfacePushSpeed / 720, 1e-6);
  EXPECT_EQ(once.positions[3], start.positions[3]);
  for (int tick = 0; tick < 5; ++tick) running.tick(inputs);
  EXPECT_NEAR(running.state().positions[2].y(), thickness, 1e-6);
  // A push gives no speed.
  EXPECT_LT(running.state().velocities[2].norm(), 1e-6);
}

TEST_F(SurfaceCollision, ASurfaceThatMovesIntoClothPushesItAtABoundedSpeed) {
  model::Scene scene = looseScene(2, 2);
  NodeState start = simulation::unpack(Running(scene).save());
  for (std::size_t i = 0; i < 4; ++i) {
    start.positions[i] = model::Vec3(0.1f * static_cast<float>(i), 0.005f, 0);
    start.velocities[i] = model::Vec3::Zero();
  }
  const auto table = tableOf(model::flat(2, 2, 2));
  Running running(scene);
  running.restore(start);
  float before = 0.005f;
  running.tick(inputsWith(scene, {{table, {}, false, 1}}));
  const model::Pose higher{model::Vec3(0, 0.02f, 0), model::Quaternion::Identity()};
  for (int tick = 0; tick < 10; ++tick) {
    running.tick(inputsWith(scene, {{table, higher, false, 1}}));
    const float now = running.state().positions[0].y();
    EXPECT_LE(now - before, model::kSurfacePushSpeed / 720 + 1e-6f);
    before = now;
  }
  EXPECT_NEAR(before, 0.02f + scene.cloths[0].thickness, 1e-6);
}

TEST_F(SurfaceCollision, FrictionHoldsClothOnASlopeUpToItsAngle) {
  for (const float degrees : {15.0f, 35.0f}) {
    model::Cloth cloth = lying(calmCloth(9, 9), 0.004f);
    cloth.thickness = 0.004f;
    cloth.friction = 1;
    cloth.damping = 0;
    model::Scene scene = sceneOf({cloth});
    // The slope is in the direction of gravity, so that the cloth begins at rest on the surface.
    const float angle = degrees * std::acos(-1.0f) / 180;
    scene.environment.gravity = 9.81f * model::Vec3(std::sin(angle), -std::cos(angle), 0);
    const TickInputs inputs = inputsWith(scene, {{tableOf(model::flat(8, 8, 4)), {}, true, 0.45f}});
    Running running(scene);
    const float from = running.state().positions[0].x();
    for (int tick = 0; tick < 72; ++tick) running.tick(inputs);
    const float slid = running.state().positions[0].x() - from;
    // atan(0.45) is 24 degrees. At 35 degrees a body slides (sin - 0.45 cos) g / 2 in a second: 1 m.
    if (degrees < 24)
      EXPECT_LT(slid, 0.005f);
    else
      EXPECT_NEAR(slid, 0.5f * 9.81f * (std::sin(angle) - 0.45f * std::cos(angle)), 0.1f);
  }
}

TEST_F(SurfaceCollision, ClothFallsWhenItsSurfaceGoes) {
  model::Cloth cloth = lying(calmCloth(9, 9), 0.006f);
  const model::Scene scene = sceneOf({cloth});
  const auto table = tableOf(model::flat(2, 2, 2));
  Running running(scene);
  for (int tick = 0; tick < 36; ++tick) running.tick(inputsWith(scene, {{table, {}, false, 1}}));
  EXPECT_GT(lowestOf(running.state()), 0);
  for (int tick = 0; tick < 36; ++tick) running.tick(inputsWith(scene, {}));
  // Half a second of free fall is 1.2 m.
  EXPECT_LT(lowestOf(running.state()), -1.0f);
  // It comes back and carries nothing that is far below it.
  running.tick(inputsWith(scene, {{table, {}, false, 1}}));
  EXPECT_LT(lowestOf(running.state()), -1.0f);
}

TEST_F(SurfaceCollision, ArrivingInPartsChangesNothing) {
  const model::Scene scene = sceneOf({lying(calmCloth(9, 9), 0.01f)});
  // 16,562 triangles: more than a tick uploads.
  const auto table = tableOf(model::terrain(2, 2, 91, model::waves));
  Running parts(scene), whole(scene);
  TickInputs inputs = inputsWith(scene, {});
  TickInputs arriving = inputs;
  arriving.arriving = {table};
  const std::size_t all = simulation::surfaceTexels(*table);
  ASSERT_GT(all, simulation::kSurfaceUploadTexels);
  const auto ticks = static_cast<int>((all - 1) / simulation::kSurfaceUploadTexels + 1);
  for (int tick = 0; tick < ticks; ++tick)
    EXPECT_EQ(parts.tick(arriving).stateHash, whole.tick(inputs).stateHash);
  inputs.surfaces = {{table, {}, false, 1}};
  for (int tick = 0; tick < 20; ++tick) EXPECT_EQ(parts.tick(inputs).stateHash, whole.tick(inputs).stateHash);
}

TEST_F(SurfaceCollision, FindsRoomWhenSurfacesAreReplacedAgainAndAgain) {
  model::Scene scene = looseScene(2, 2);
  NodeState start = simulation::unpack(Running(scene).save());
  for (std::size_t i = 0; i < 4; ++i) {
    start.positions[i] = model::Vec3(0.1f * static_cast<float>(i), 0.01f, 0);
    start.velocities[i] = model::Vec3(0, -1, 0);
  }
  Running running(scene);
  running.restore(start);
  // 80,000 triangles at a time, of sizes that leave gaps.
  std::vector<PlacedSurface> surfaces;
  for (std::uint32_t tick = 0; tick < 24; ++tick) {
    const std::uint32_t cells = 80 + 37 * (tick % 3);
    surfaces.push_back({tableOf(model::flat(2, 2, cells)), {}, false, 1});
    std::size_t triangles = 0;
    for (const PlacedSurface& placed : surfaces) triangles += placed.table->surface.triangles.size();
    while (triangles > 90'000) {
      triangles -= surfaces.front().table->surface.triangles.size();
      surfaces.erase(surfaces.begin());
    }
    ASSERT_TRUE(running.tick(inputsWith(scene, surfaces)).healthy);
  }
  for (const model::Vec3& position : running.state().positions)
    EXPECT_NEAR(position.y(), scene.cloths[0].thickness, 1e-6);
}

// Cloth falls on waves of two surfaces, and a third one stands next to it.
TickInputs fallingOnSurfaces(const model::Scene& scene, int tick) {
  static const auto wavy = tableOf(model::terrain(1, 1, 24, model::waves)),
                    desk = tableOf(model::flat(0.3f, 1));
  const model::Pose moving{model::Vec3(-0.1f, 0.001f * static_cast<float>(tick), 0),
                           turned(5, model::Vec3::UnitZ())};
  const model::Pose wall{model::Vec3(0.1f, 0, 0), turned(90, model::Vec3::UnitZ())};
  return inputsWith(scene, {{wavy, {}, false, 0.8f}, {desk, moving, true, 0.3f}, {desk, wall, false, 1}});
}

TEST_F(SurfaceCollision, GivesTheSameBitsForEveryPartitionOfTheWork) {
  const model::Scene scene = sceneOf({lying(calmCloth(13, 13), 0.05f), lying(calmCloth(7, 5), 0.08f)});
  const simulation::SimulationOptions ways[] = {
      {.workgroupSize = 32}, {.workgroupSize = 64}, {.workgroupSize = 128}};
  expectSameBits(scene, fallingOnSurfaces, 40, ways);
}

TEST_F(SurfaceCollision, WorksFarFromTheOriginOfTheWorld) {
  const model::Vec3 far(600, 40, -700);
  model::Cloth cloth = lying(calmCloth(9, 9), 0.01f);
  cloth.grid.pose.position += far;
  const model::Scene scene = sceneOf({cloth});
  Running running(scene);
  const TickInputs inputs =
      inputsWith(scene, {{tableOf(model::flat(1, 1, 2)), {far, model::Quaternion::Identity()}, false, 1}});
  for (int tick = 0; tick < 36; ++tick) ASSERT_TRUE(running.tick(inputs).healthy);
  // Places in the world are rounded to 6e-5 m there.
  EXPECT_NEAR(lowestOf(running.state()), far.y() + std::max(cloth.thickness, 5e-4f), 2e-4);
}

// The limit of a scene: two surfaces of 50,000 triangles. Costs about 2 s, most of them for the trees.
TEST_F(SurfaceCollision, CarriesClothOnOneHundredThousandTriangles) {
  const model::Scene scene = sceneOf({lying(calmCloth(21, 21), 0.06f)});
  const auto table = tableOf(model::terrain(4, 4, 158, model::waves));
  const model::Pose lower{model::Vec3(0, -1, 0), model::Quaternion::Identity()};
  const TickInputs inputs = inputsWith(
      scene, {{table, {}, false, 1}, {tableOf(model::terrain(4, 4, 158, model::waves)), lower, false, 1}});
  Running running(scene);
  for (int tick = 0; tick < 72; ++tick) ASSERT_TRUE(running.tick(inputs).healthy);
  for (const model::Vec3& position : running.state().positions)
    EXPECT_GT(position.y(), model::waves(position.x(), position.z()) - 0.005f);
}

// 50,000 triangles in one place: the searches end early, and nodes that need them stay where they are.
TEST_F(SurfaceCollision, AHeapOfTrianglesHoldsNothingUp) {
  model::Scene scene = looseScene(9, 9);
  model::Triangles heap;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-0.2f, 0.2f);
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    for (int corner = 0; corner < 3; ++corner)
      heap.vertices.emplace_back(unit(random), unit(random), unit(random));
    heap.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const TickInputs inputs = inputsWith(scene, {{tableOf(heap), {}, true, 1}});
  Running running(scene);
  for (int tick = 0; tick < 3; ++tick) EXPECT_TRUE(running.tick(inputs).healthy);
}

}  // namespace
}  // namespace clothstream::tests
