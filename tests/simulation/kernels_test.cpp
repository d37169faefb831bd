// SPDX-License-Identifier: MIT
// Each kernel against the double-precision reference, one substep from random states.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;

// Upper bound of the speeds in these tests, m/s.
constexpr double kSpeed = 3;
// Largest difference of a normal's length from 1: the error of reciprocalSquareRoot, and three roundings.
constexpr double kUnitLength = 7e-7 + 3 * kRounding;

struct Expectation {
  float displacement = 0.005f;
  float speed = 1;
  double extraForce = 0;  // N, of rounding that is not the springs'
  int steps = 1;          // that a substep is made of
};

class Kernels : public GpuTest {
 protected:
  // Compares one substep of both from the same random state.
  // Tolerance: the error of a spring's force is the rounding of the difference of its ends (2 kRounding of
  // their positions) times its stiffness, plus some ten roundings of the force. The error of its damping is
  // of the same number of roundings. A node has twelve springs. The force moves a velocity by h / m times its
  // error, and a position by h times that. Velocity and position are rounded a few times themselves.
  static void expectLikeReference(model::Scene scene, std::vector<simulation::MovingCollider> colliders,
                                  unsigned seed, const Expectation& expectation = {}) {
    scene.substeps = 1;
    scene.simulationRate = 720;
    const simulation::TickInputs inputs = inputsOf(scene, std::move(colliders));
    std::mt19937 random(seed);
    const NodeState start = randomState(scene, random, expectation.displacement, expectation.speed);
    Running running(scene);
    running.restore(start);
    EXPECT_TRUE(running.tick(inputs).healthy);
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    reference.tick(referenceInputs(inputs));

    const model::Spring& spring = scene.cloths.front().structural;  // the stiffest
    const double longest = 0.06, nodeMass = 0.01, h = scene.substepSeconds();
    const double force =
        12 * kRounding * (spring.stiffness * (2 * kExtent + 10 * longest) + spring.damping * 20 * kSpeed) +
        expectation.extraForce;
    const double speed = expectation.steps * (h / nodeMass * force + 8 * kRounding * kSpeed);
    const double distance = h * speed + expectation.steps * 2 * kRounding * kExtent;
    const NodeState state = running.state();
    EXPECT_LT(largestSpeedDifference(state, reference), speed);
    EXPECT_LT(largestDistance(state, reference), distance);
    // Both have moved much farther than the tolerance, so the comparison can fail.
    setState(reference, start);
    EXPECT_GT(largestSpeedDifference(state, reference), 1000 * speed);
  }
};

TEST_F(Kernels, SpringsPullAsInTheReferenceOnEveryShapeOfGrid) {
  const std::pair<std::uint32_t, std::uint32_t> shapes[] = {{2, 2},  {2, 3},   {3, 2},  {3, 65},
                                                            {65, 3}, {17, 23}, {33, 64}};
  unsigned seed = 1;
  for (const auto& [rows, columns] : shapes) {
    SCOPED_TRACE(::testing::Message() << rows << " x " << columns);
    expectLikeReference(sceneOf({calmCloth(rows, columns)}), {}, seed++);
  }
}

// A grid that is given as a mesh, and a disc whose nodes are at least as heavy as those of a grid. Grids are
// before and between them.
TEST_F(Kernels, MeshesPullAsInTheReference) {
  expectLikeReference(sceneOf({model::asMesh(calmCloth(17, 23))}), {}, 21);
  expectLikeReference(sceneOf({discCloth(11)}), {}, 22);
  model::Cloth pinned = discCloth(5);
  pinned.pinnedVertices = {0, 3, 60};
  expectLikeReference(sceneOf({calmCloth(5, 7), discCloth(6), calmCloth(9, 4), pinned}), {}, 23);
}

TEST_F(Kernels, UndampedMeshesPullAsInTheReference) {
  model::Cloth cloth = discCloth(9);
  cloth.structural.damping = cloth.bend.damping = 0;
  expectLikeReference(sceneOf({cloth}), {}, 24);
}

TEST_F(Kernels, UndampedSpringsPullAsInTheReference) {
  model::Cloth cloth = calmCloth(17, 23);
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0;
  expectLikeReference(sceneOf({cloth}), {}, 2);
}

TEST_F(Kernels, GridsLongerOneWayPullAsInTheReference) {
  model::Cloth cloth = calmCloth(20, 21);
  cloth.grid.height *= 1.5f;
  cloth.pins = {topRow(cloth)};
  expectLikeReference(sceneOf({cloth}), {}, 3);
}

TEST_F(Kernels, ExplicitEulerStepsAsTheReference) {
  model::Scene scene = sceneOf({calmCloth(17, 23)});
  scene.integrator = model::Integrator::explicitEuler;
  expectLikeReference(scene, {}, 4);
}

TEST_F(Kernels, RungeKuttaStepsAsTheReference) {
  model::Scene scene = sceneOf({calmCloth(17, 23), discCloth(6), calmCloth(2, 3)});
  scene.integrator = model::Integrator::rungeKutta4;
  scene.cloths.front().pins = {topRow(scene.cloths.front())};
  expectLikeReference(scene, {}, 31, {.steps = 4});
  scene.environment.gravity =
      model::Vec3(0, 0, -100);  // far from the plane's edge between the two arithmetics
  const model::Quaternion up = turned(90, model::Vec3::UnitX());
  expectLikeReference(scene,
                      {{model::Plane{}, {model::Vec3(0, 0, 0.02f), up}, {model::Vec3(0, 0, 0.02f), up}, 1}},
                      32, {.steps = 4});
}

TEST_F(Kernels, AirDragsAndLiftsAsInTheReference) {
  model::Cloth cloth = calmCloth(17, 23);
  cloth.drag = 0.8f;
  cloth.lift = 0.6f;
  model::Scene scene = sceneOf({cloth});
  scene.environment.wind = model::Vec3(3, -1, 8);
  // A triangle's area (2e-4 m^2) has an error of two roundings of its corners' positions times its sides
  // (0.03 m). Its force, density / 6 |u|^2 (drag + 2 lift) times the area, adds some twenty roundings. A node
  // has six triangles.
  const double pressure = 1.2 / 6 * 15 * 15 * (0.8 + 2 * 0.6);
  const double air = 6 * kRounding * pressure * (2 * kExtent * 2 * 0.03 + 20 * 2e-4);
  expectLikeReference(scene, {}, 5, {.extraForce = air});
}

TEST_F(Kernels, AirDragsAndLiftsMeshesAsInTheReference) {
  model::Cloth cloth = discCloth(9);
  cloth.drag = 0.8f;
  cloth.lift = 0.6f;
  model::Scene scene = sceneOf({cloth});
  scene.environment.wind = model::Vec3(3, -1, 8);
  const double pressure = 1.2 / 6 * 15 * 15 * (0.8 + 2 * 0.6);
  const double air = 6 * kRounding * pressure * (2 * kExtent * 2 * 0.03 + 20 * 2e-4);
  expectLikeReference(scene, {}, 25, {.extraForce = air});
}

// Winds from several sides over a grid and a disc. A place has three roundings of kExtent, so that the air's
// velocity, whose gradient is at most 4 speed / radius, is as exact as the area of a triangle.
TEST_F(Kernels, LocalWindsBlowAsInTheReference) {
  const model::Quaternion ahead = turned(90, model::Vec3::UnitX());
  const double pressure = 1.2 / 6 * 21 * 21 * (0.8 + 2 * 0.6);
  const double gradient = 1.2 / 6 * 2 * 21 * (4 * 6 / 0.1) * 3 * kRounding * kExtent * 2e-4 * (0.8 + 2 * 0.6);
  const double air = 6 * (kRounding * pressure * (2 * kExtent * 2 * 0.03 + 40 * 2e-4) + gradient);
  for (model::Cloth cloth : {calmCloth(17, 23), discCloth(9)}) {
    cloth.drag = 0.8f;
    cloth.lift = 0.6f;
    model::Scene scene = sceneOf({cloth});
    scene.environment.wind = model::Vec3(3, -1, 8);
    scene.winds = {
        {{{model::Vec3(0.05f, -0.1f, -0.2f), ahead}, 5, model::Fan{.radius = 0.1f, .range = 1}}, "fan"},
        {{{model::Vec3(-0.1f, -0.2f, 0.1f), turned(40, model::Vec3(1, 2, 0.5f))},
          6,
          model::Vortex{.radius = 0.1f, .reach = 0.5f}},
         "vortex"}};
    expectLikeReference(scene, {}, 26, {.extraForce = air});
  }
}

TEST_F(Kernels, AirPushesStillClothWithoutSpringDamping) {
  model::Cloth cloth = calmCloth(12, 9);
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0;
  cloth.drag = 1;
  model::Scene scene = sceneOf({cloth});
  scene.environment.wind = model::Vec3(0, 0, 10);
  const double air = 6 * kRounding * 1.2 / 6 * 110 * (2 * kExtent * 2 * 0.03 + 20 * 2e-4);
  expectLikeReference(scene, {}, 6, {.extraForce = air});
}

TEST_F(Kernels, MovingSpheresCollideAsInTheReference) {
  model::Cloth cloth = calmCloth(30, 30);
  cloth.friction = 0.4f;
  // Two that overlap in the middle of the cloth, one that touches a corner; friction that stops and friction
  // that slows. Where a node lies at a sphere's surface to within rounding, inside for one of the two, no
  // velocity changes unless it moves inwards; these seeds have none there.
  const std::vector<simulation::MovingCollider> spheres{
      {model::Sphere{0.1f}, {model::Vec3(0, -0.25f, 0.06f)}, {model::Vec3(0.001f, -0.25f, 0.055f)}, 1},
      {model::Sphere{0.1f}, {model::Vec3(0.08f, -0.3f, -0.06f)}, {model::Vec3(0.08f, -0.3f, -0.05f)}, 5},
      {model::Sphere{0.05f}, {model::Vec3(0.29f, 0, 0)}, {model::Vec3(0.29f, 0, 0)}, 0}};
  // Out of a sphere, a velocity turns by the rounding of the normal, two roundings of places over the radius.
  const double h = 1.0 / 720, nodeMass = 0.01;
  const double turned = 10 * kSpeed * 2 * kRounding * kExtent / 0.05 * nodeMass / h;
  expectLikeReference(sceneOf({cloth}), spheres, 7,
                      {.displacement = 0.005f, .speed = 1, .extraForce = turned});
}

TEST_F(Kernels, MovingSpheresCollideWithMeshesAsInTheReference) {
  model::Cloth cloth = discCloth(12);
  cloth.friction = 0.4f;
  const std::vector<simulation::MovingCollider> spheres{
      {model::Sphere{0.1f}, {model::Vec3(0.05f, 0.08f, 0)}, {model::Vec3(0.051f, 0.075f, 0)}, 1},
      {model::Sphere{0.1f}, {model::Vec3(-0.1f, -0.06f, 0.02f)}, {model::Vec3(-0.1f, -0.05f, 0.02f)}, 5}};
  const double h = 1.0 / 720, nodeMass = 0.01;
  const double turned = 10 * kSpeed * 2 * kRounding * kExtent / 0.05 * nodeMass / h;
  expectLikeReference(sceneOf({cloth}), spheres, 26,
                      {.displacement = 0.005f, .speed = 1, .extraForce = turned});
}

// Each shape moves and turns through the middle of the cloth, which comes from both sides; some nodes start
// inside. A contact errs by roundings of places in the shape's frame (ten of kExtent), in position and, over
// a substep, in velocity. Seeds have no node within rounding of two faces at once.
TEST_F(Kernels, TurningShapesCollideAsInTheReference) {
  const model::Pose from{model::Vec3(0.01f, -0.25f, 0.02f), turned(20, model::Vec3(1, 2, 3))};
  const model::Pose to{model::Vec3(0.013f, -0.26f, 0.012f), turned(22, model::Vec3(1, 2.2f, 3))};
  const model::Shape shapes[] = {model::Capsule{.radius = 0.05f, .length = 0.3f}, model::Plane{},
                                 model::Box{model::Vec3(0.2f, 0.1f, 0.3f)}, octahedron(),
                                 model::Capsule{.radius = 0.05f, .length = 0.2f, .topRadius = 0.12f}};
  unsigned seed = 20;
  for (const model::Shape& shape : shapes) {
    SCOPED_TRACE(::testing::Message() << "shape " << shape.index());
    model::Cloth cloth = calmCloth(30, 30);
    cloth.friction = 0.4f;
    const double h = 1.0 / 720, nodeMass = 0.01;
    const double turnedBy = 10 * kSpeed * 2 * kRounding * kExtent / 0.05 * nodeMass / h;
    const double carried = 10 * kRounding * kExtent / h * nodeMass / h;
    expectLikeReference(sceneOf({cloth}), {{shape, from, to, 1}}, seed++,
                        {.displacement = 0.02f, .speed = 1, .extraForce = turnedBy + carried});
  }
}

TEST_F(Kernels, NormalsPointAsInTheReference) {
  model::Scene scene = sceneOf({calmCloth(19, 33), calmCloth(2, 2), discCloth(8)});
  scene.cloths[1].grid.pose.position = model::Vec3(0, 1, 0);
  std::mt19937 random(8);
  const NodeState state = randomState(scene, random, 0.006f, 0);
  Running running(scene);
  running.restore(state);
  const std::vector<model::Vec3> normals = running.normals();
  reference::ReferenceSimulation reference(scene);
  setState(reference, state);
  std::size_t node = 0;
  const double tenthOfADegree = 0.1 * std::acos(-1.0) / 180;
  for (const reference::ReferenceCloth& cloth : reference.cloths())
    for (const reference::Vec3& expected : cloth.normals()) {
      const reference::Vec3 normal = normals[node++].cast<double>();
      EXPECT_NEAR(normal.norm(), 1, kUnitLength);
      EXPECT_LT((normal - expected).norm(), tenthOfADegree);
    }
}

TEST_F(Kernels, NormalsOfAFlatClothFaceTheViewerToTheBit) {
  Running running(sceneOf({calmCloth(9, 9)}));
  for (const model::Vec3& normal : running.normals()) {
    EXPECT_EQ(normal.x(), 0);
    EXPECT_EQ(normal.y(), 0);
    EXPECT_NEAR(normal.z(), 1, kUnitLength);
  }
}

TEST_F(Kernels, AClothCollapsedToAPointHasTheDefaultNormal) {
  const model::Scene scene = sceneOf({calmCloth(3, 3)});
  NodeState state = simulation::restState(scene.cloths);
  for (model::Vec3& position : state.positions) position = model::Vec3(1, 2, 3);
  Running running(scene);
  running.restore(state);
  for (const model::Vec3& normal : running.normals()) EXPECT_EQ(normal, model::Vec3(0, 0, 1));
}

}  // namespace
}  // namespace clothstream::tests
