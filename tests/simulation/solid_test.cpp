// SPDX-License-Identifier: MIT
// Cloth against closed triangle meshes.
#include <algorithm>
#include <cmath>
#include <tuple>

#include <gtest/gtest.h>

#include "server/simulation/collision/triangle_tree.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::ballMesh;
using model::boxMesh;
using model::torus;
using simulation::MovingCollider;
using simulation::NodeState;

class SolidCollision : public GpuTest {};

model::Scene solidScene(model::Cloth cloth, const std::vector<model::Shape>& shapes) {
  model::Scene scene = sceneOf({std::move(cloth)});
  for (const model::Shape& shape : shapes) scene.colliders.push_back({.name = "solid", .shape = shape});
  return scene;
}

// Nodes everywhere around the meshes, which turn and move, against the reference. Contacts inside, outside,
// near edges and corners, and in hollows are among them.
TEST_F(SolidCollision, NodesTouchMeshesAsInTheReference) {
  const model::Shape shapes[] = {torus(0.12f, 0.04f, 24, 12), boxMesh(model::Vec3(0.2f, 0.1f, 0.15f)),
                                 ballMesh(0.12f, 10)};
  for (const model::Shape& shape : shapes) {
    model::Scene scene = solidScene(looseCloth(33, 33), {shape});
    scene.substeps = 1;
    scene.simulationRate = 720;
    scene.environment.gravity = model::Vec3::Zero();
    std::mt19937 random(17);
    NodeState start = randomState(scene, random, 0, 3);
    std::uniform_real_distribution<float> unit(-0.2f, 0.2f);
    for (model::Vec3& position : start.positions)
      position = model::Vec3(unit(random), unit(random), unit(random));
    const model::Pose from{model::Vec3(0.01f, 0.02f, 0), turned(25, model::Vec3(1, 0.3f, 0.2f))};
    const model::Pose to{model::Vec3(0.011f, 0.021f, 0.003f), turned(26, model::Vec3(1, 0.3f, 0.2f))};
    const simulation::TickInputs inputs = inputsOf(scene, {{shape, from, to, 1}});
    Running running(scene);
    running.restore(start);
    EXPECT_TRUE(running.tick(inputs).healthy);
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    reference.tick(referenceInputs(inputs));
    const NodeState after = running.state();
    // A contact has the rounding of some forty products of lengths below 0.5 m. Its normal has that error
    // divided by the distance from the surface, 0.1 mm at least, and so has the velocity.
    const double distance = 40 * kRounding * 0.5;
    EXPECT_LT(largestDistance(after, reference), distance) << "shape " << shape.index();
    EXPECT_LT(largestSpeedDifference(after, reference), 10 * distance / 1e-4);
    NodeState untouched = start;
    for (std::size_t i = 0; i < start.positions.size(); ++i)
      untouched.positions[i] += start.velocities[i] / 720;
    std::size_t moved = 0;
    for (std::size_t i = 0; i < start.positions.size(); ++i)
      moved += (after.positions[i] - untouched.positions[i]).norm() > 1e-4f;
    EXPECT_GT(moved, 50u);
  }
}

// Nodes around meshes with sampled distances, which turn and move, against the reference. Many begin outside
// of the grids.
TEST_F(SolidCollision, NodesTouchSampledDistancesAsInTheReference) {
  const model::Shape shapes[] = {model::sampled(torus(0.12f, 0.04f, 16, 8), 0.01f),
                                 model::sampled(ballMesh(0.12f, 6), 0.02f)};
  for (const model::Shape& shape : shapes) {
    model::Scene scene = solidScene(looseCloth(33, 33), {shape});
    scene.substeps = 1;
    scene.simulationRate = 720;
    scene.environment.gravity = model::Vec3::Zero();
    std::mt19937 random(17);
    NodeState start = randomState(scene, random, 0, 3);
    std::uniform_real_distribution<float> unit(-0.2f, 0.2f);
    for (model::Vec3& position : start.positions)
      position = model::Vec3(unit(random), unit(random), unit(random));
    const model::Pose from{model::Vec3(0.01f, 0.02f, 0), turned(25, model::Vec3(1, 0.3f, 0.2f))};
    const model::Pose to{model::Vec3(0.011f, 0.021f, 0.003f), turned(26, model::Vec3(1, 0.3f, 0.2f))};
    const simulation::TickInputs inputs = inputsOf(scene, {{shape, from, to, 1}});
    Running running(scene);
    running.restore(start);
    EXPECT_TRUE(running.tick(inputs).healthy);
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    reference.tick(referenceInputs(inputs));
    // As with triangles. The slope of a cell has the rounding of its samples, 0.2 m at most, divided by the
    // cell, and acts over a depth of 4 cm.
    const double distance = 40 * kRounding * 0.5 + 0.04 * 8 * kRounding * 0.2 / 0.01;
    EXPECT_LT(largestDistance(running.state(), reference), distance) << "shape " << shape.index();
    std::size_t moved = 0;
    for (std::size_t i = 0; i < start.positions.size(); ++i) {
      const model::Vec3 free = start.positions[i] + start.velocities[i] / 720;
      moved += (running.state().positions[i] - free).norm() > 1e-4f;
    }
    EXPECT_GT(moved, 50u);
  }
}

// Nodes near a sampled ball end at the thickness from it, within what trilinear interpolation allows. Second
// derivatives of the distance from a ball are 1/r along two axes at most, so that cell^2 / 8 times 2 / r
// bounds the error of the distance.
TEST_F(SolidCollision, SampledDistancesOfABallAreWithinTheErrorOfTheirInterpolation) {
  constexpr float kRadius = 0.12f, kCell = 0.012f, kThickness = 0.004f, kBand = 0.004f;
  constexpr std::uint32_t kRings = 48;
  const model::Shape shape = model::sampled(ballMesh(kRadius, kRings), kCell);
  model::Cloth cloth = looseCloth(33, 33);
  cloth.thickness = kThickness;
  model::Scene scene = solidScene(cloth, {shape});
  scene.substeps = 1;
  scene.environment.gravity = model::Vec3::Zero();
  std::mt19937 random(3);
  NodeState start = randomState(scene, random, 0, 0);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (model::Vec3& position : start.positions)
    position =
        model::Vec3(unit(random), unit(random), unit(random)).normalized() * (kRadius + kBand * unit(random));
  Running running(scene);
  running.restore(start);
  running.tick(inputsOf(scene, {{shape, model::Pose{}, model::Pose{}, 1}}));
  const double least = kRadius - kBand;
  const double interpolation = kCell * kCell / 8 * 2 / least;
  // A flat triangle is this much inside of the ball, its corners on it.
  const double facet = kRadius * (1 - std::cos(std::acos(-1.0) / kRings));
  // The normal differs from the ball's by the error of the slope, cell / 2 times 2 / r, over the depth.
  const double slant = (kThickness + kBand) * std::pow(kCell / least, 2) / 2;
  for (const model::Vec3& position : running.state().positions) {
    const double distance = double{position.norm()} - kRadius;
    ASSERT_GT(distance, kThickness - interpolation - facet - slant - 1e-6);
    ASSERT_LT(distance, kThickness + interpolation + slant + 1e-6);
  }
}

// Cloth with sampled distances below it hangs into the hole of a ring, and is outside by the reference's
// distances after any tick. A report finds no node inside.
TEST_F(SolidCollision, ClothOnASampledRingStaysOutside) {
  const model::Solid ring = model::sampled(torus(0.12f, 0.03f, 16, 8), 0.01f);
  model::Cloth cloth = calmCloth(21, 21);
  cloth.grid.pose = {model::Vec3(0, 0.06f, -cloth.grid.height / 2), turned(-90, model::Vec3::UnitX())};
  cloth.damping = 3;
  cloth.thickness = 0.004f;
  const model::Scene scene = solidScene(cloth, {ring});
  Running running(scene);
  double deepest = 0;
  for (int tick = 0; tick < 72; ++tick) {
    running.tick(inputsOf(scene, {{ring, model::Pose{}, model::Pose{}, 1}}));
    if (tick % 24 != 23) continue;
    for (const model::Vec3& position : running.state().positions)
      deepest = std::max(deepest, 0.004 - reference::heightOver(ring, {}, position.cast<double>()));
  }
  // The way out is along the slope of the cell, whose error is at most half a cell times the second
  // derivatives, 1 / 0.03 m along two axes. It is at most as long as the way of a node in a substep, which
  // falls from 6 cm.
  const double way = std::sqrt(2 * 9.81 * 0.06) * scene.substepSeconds();
  EXPECT_LT(deepest, way * 0.01 / 2 * std::sqrt(2.0) / 0.03);
  float lowest = 1;
  for (const model::Vec3& position : running.state().positions) lowest = std::min(lowest, position.y());
  EXPECT_LT(lowest, 0.02f);
}

// A thin ring that is thrown at 25 m/s carries the nodes that it hits and lets none through. Nodes inside the
// ring stay where they are.
TEST_F(SolidCollision, AFastThinRingTakesTheNodesInItsWayAndNoOthers) {
  const model::Shape ring = torus(0.12f, 0.004f, 48, 8);
  model::Cloth cloth = looseCloth(33, 33);
  cloth.thickness = 0;
  model::Scene scene = solidScene(cloth, {ring});
  scene.environment.gravity = model::Vec3::Zero();
  const float step = 25.0f / 72;
  const auto at = [&](int tick) {
    return model::Pose{model::Vec3(0.002f, -0.317f, 0.61f - step * static_cast<float>(tick)),
                       turned(90, model::Vec3::UnitX())};
  };
  Running running(scene);
  const std::vector<model::Vec3> before = running.state().positions;
  for (int tick = 0; tick < 4; ++tick) running.tick(inputsOf(scene, {{ring, at(tick), at(tick + 1), 1}}));
  const NodeState after = running.state();
  int hit = 0, inside = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double radius = std::hypot(double{before[i].x()} - 0.002, double{before[i].y()} + 0.317);
    if (std::abs(radius - 0.12) < 0.003) {
      ++hit;
      EXPECT_LT(after.velocities[i].z(), -1) << "node " << i;
    } else if (radius < 0.11) {
      ++inside;
      EXPECT_EQ(after.positions[i], before[i]);
    }
  }
  EXPECT_GE(hit, 10);
  EXPECT_GE(inside, 60);
}

// Cloth over a ring hangs into its hole; nothing is below the surface after any tick.
TEST_F(SolidCollision, ClothOnARingStaysOutside) {
  const model::Solid ring = torus(0.12f, 0.03f, 32, 16);
  model::Cloth cloth = calmCloth(21, 21);
  cloth.grid.pose = {model::Vec3(0, 0.06f, -cloth.grid.height / 2), turned(-90, model::Vec3::UnitX())};
  cloth.damping = 3;
  cloth.thickness = 0.004f;
  const model::Scene scene = solidScene(cloth, {ring});
  const model::Pose still{};
  Running running(scene);
  double deepest = 0;
  for (int tick = 0; tick < 144; ++tick) {
    running.tick(inputsOf(scene, {{ring, still, still, 1}}));
    if (tick % 8 == 7)
      for (const model::Vec3& position : running.state().positions)
        deepest = std::max(deepest, 0.004 - reference::heightOver(ring, {}, position.cast<double>()));
  }
  EXPECT_LT(deepest, 2e-6);
  float lowest = 1, highest = -1;
  for (const model::Vec3& position : running.state().positions) {
    lowest = std::min(lowest, position.y());
    highest = std::max(highest, position.y());
  }
  EXPECT_LT(lowest, 0);        // it hangs into the hole or over the rim
  EXPECT_GT(highest, 0.033f);  // it lies on the ring
}

// The order of the inputs is that of the report, although meshes act after other colliders.
TEST_F(SolidCollision, ReportsImpulsesUnderTheNumbersOfTheInputs) {
  model::Cloth cloth = calmCloth(5, 7);
  cloth.grid.pose = {model::Vec3(0, 0.02f, -cloth.grid.height / 2), turned(-90, model::Vec3::UnitX())};
  cloth.damping = 0;
  cloth.thickness = 0;
  cloth.friction = 0;
  const model::Solid slab = boxMesh(model::Vec3(1, 0.1f, 1));
  const model::Scene scene = solidScene(cloth, {slab});
  const model::Pose below{model::Vec3(0, -0.05f, 0), model::Quaternion::Identity()};
  const model::Pose far{model::Vec3(0, -9, 0), model::Quaternion::Identity()};
  simulation::TickInputs inputs =
      inputsOf(scene, {{slab, below, below, 1}, {model::Sphere{0.1f}, far, far, 1}});
  inputs.reportsContacts = true;
  Running running(scene);
  double impulse = 0;
  for (int tick = 0; tick < 36; ++tick) {
    running.tick(inputs);
    for (const simulation::ContactStatus& contact : running.contacts()) {
      EXPECT_EQ(contact.collider, 0u);
      impulse += contact.impulse;
    }
  }
  const double expected = double{cloth.mass} * 9.81 * 36 / 72;
  EXPECT_NEAR(impulse, expected, 0.01 * expected);
}

TEST_F(SolidCollision, GivesTheSameBitsForEveryPartitionOfTheWork) {
  model::Scene scene = solidScene(calmCloth(21, 19), {torus(0.12f, 0.04f, 24, 12)});
  const InputsAt inputs = [](const model::Scene& in, int tick) {
    const auto at = [](int t) {
      return model::Pose{model::Vec3(0, -0.2f, 0.2f - 0.004f * static_cast<float>(t)),
                         turned(2 * static_cast<float>(t), model::Vec3(1, 2, 0.5f))};
    };
    return inputsOf(in, {{in.colliders[0].shape, at(tick), at(tick + 1), 1}});
  };
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 32}, {.workgroupSize = 128}};
  expectSameBits(scene, inputs, 60, ways);
}

TEST(TriangleTree, HasEachTriangleOnceInABoxThatContainsIt) {
  for (const model::Solid& solid : {boxMesh(model::Vec3(1, 2, 3)), torus(0.12f, 0.04f, 24, 11)}) {
    const simulation::TriangleTree tree = simulation::makeTriangleTree(solid->vertices, solid->triangles);
    std::vector<std::uint32_t> sorted = tree.order;
    std::ranges::sort(sorted);
    for (std::uint32_t i = 0; i < solid->triangles.size(); ++i) EXPECT_EQ(sorted[i], i);
    for (std::size_t leaf = 0; leaf < tree.leafCount; ++leaf) {
      EXPECT_LE(tree.firstOf(leaf + 1) - tree.firstOf(leaf), simulation::kLeafTriangles);
      for (std::size_t i = tree.firstOf(leaf); i < tree.firstOf(leaf + 1); ++i)
        for (const std::uint32_t corner : solid->triangles[tree.order[i]])
          for (std::size_t node = tree.leafCount + leaf; node > 0; node /= 2) {
            const simulation::TriangleTree::Box& box = tree.boxes[node];
            EXPECT_TRUE((solid->vertices[corner].array() >= box.low.array()).all() &&
                        (solid->vertices[corner].array() <= box.high.array()).all());
          }
    }
  }
}

}  // namespace
}  // namespace clothstream::tests
