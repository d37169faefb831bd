// SPDX-License-Identifier: MIT
// Cloth against every shape: slopes, spin, speed, and lists of what is near that cannot be seen in the state.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::MovingCollider;
using simulation::NodeState;

class Collision : public GpuTest {};

MovingCollider resting(const scene::Shape& shape, const scene::Pose& pose) {
  return {shape, pose, pose, 1};
}

// Lies flat, at this height.
scene::Cloth lyingCloth(std::uint32_t rows, std::uint32_t columns, float height) {
  scene::Cloth cloth = calmCloth(rows, columns);
  cloth.grid.pose = {scene::Vec3(0, height, -cloth.grid.height / 2), turned(-90, scene::Vec3::UnitX())};
  cloth.damping = 0;
  cloth.thickness = 0;
  return cloth;
}

double meanAlong(const std::vector<scene::Vec3>& vectors, const scene::Vec3& direction) {
  double sum = 0;
  for (const scene::Vec3& v : vectors) sum += v.cast<double>().dot(direction.cast<double>());
  return sum / static_cast<double>(vectors.size());
}

// A sheet on a slope of 30 degrees, tan 0.577: its speed after half a second.
double speedOnASlope(const scene::Shape& shape, float friction) {
  scene::Cloth cloth = lyingCloth(4, 4, 0);
  const scene::Quaternion tilt = turned(-30, scene::Vec3::UnitZ());  // down towards +X
  cloth.grid.pose = {tilt * cloth.grid.pose.position, tilt * cloth.grid.pose.orientation};
  cloth.friction = friction;
  const scene::Scene scene = sceneOf({cloth});
  scene::Pose pose{scene::Vec3::Zero(), tilt};
  if (const auto* box = std::get_if<scene::Box>(&shape))
    pose.position = tilt * scene::Vec3(0, -box->size.y() / 2, 0);
  Running running(scene);
  for (int tick = 0; tick < 36; ++tick) running.tick(inputsOf(scene, {resting(shape, pose)}));
  return meanAlong(running.state().velocities, tilt * scene::Vec3::UnitX());
}

TEST_F(Collision, aSheetOnASlopeSticksIfFrictionReachesItsTangent) {
  for (const scene::Shape& shape :
       {scene::Shape(scene::Plane{}), scene::Shape(scene::Box{scene::Vec3(8, 1, 8)})}) {
    EXPECT_NEAR(speedOnASlope(shape, 0.6f), 0, 1e-4);
    const double sliding = 9.81 * (std::sin(std::acos(-1.0) / 6) - 0.3 * std::cos(std::acos(-1.0) / 6)) * 0.5;
    EXPECT_NEAR(speedOnASlope(shape, 0.3f), sliding, 0.01 * sliding);
    EXPECT_NEAR(speedOnASlope(shape, 0), 9.81 * 0.5 * 0.5, 0.01 * 9.81 * 0.25);
  }
}

// What lies on a shape that spins about Y goes round with it: friction carries it, springs hold it together.
TEST_F(Collision, spinCarriesTheCloth) {
  const float radius = 0.3f, rate = 1;  // rad/s
  const scene::Shape shapes[] = {scene::Sphere{radius},
                                 scene::Capsule{.radius = 0.1f, .length = 2 * radius - 0.2f},
                                 scene::Box{scene::Vec3(0.5f, 2 * radius, 0.5f)}};
  for (const scene::Shape& shape : shapes) {
    scene::Cloth cloth = lyingCloth(5, 5, radius);
    cloth.damping = 1;
    cloth.friction = 1;
    const scene::Scene scene = sceneOf({cloth});
    Running running(scene);
    const auto at = [&](int tick) {
      return scene::Pose{
          scene::Vec3::Zero(),
          turned(static_cast<float>(tick) / 72 * rate * 180 / std::acos(-1.0f), scene::Vec3::UnitY())};
    };
    for (int tick = 0; tick < 144; ++tick)
      running.tick(inputsOf(scene, {{shape, at(tick), at(tick + 1), 1}}));
    const NodeState state = running.state();
    double spin = 0;
    for (const std::size_t corner : {0u, 4u, 20u, 24u}) {
      const scene::Vec3 arm = state.positions[corner], velocity = state.velocities[corner];
      spin += double{(arm.z() * velocity.x() - arm.x() * velocity.z()) /
                     (arm.x() * arm.x() + arm.z() * arm.z())} /
              4;
    }
    EXPECT_NEAR(spin, double{rate}, 0.1) << "shape " << shape.index();
  }
}

// 25 m/s are 35 mm in a substep: several times the thickness of what flies here. Whatever is hit is carried
// in front of it, and nothing is passed through.
TEST_F(Collision, nothingFastAndThinPassesThroughTheCloth) {
  scene::Scene scene = sceneOf({calmCloth(33, 33)});
  scene::Cloth& cloth = scene.cloths[0];
  cloth.structural = cloth.shear = cloth.bend = {};  // dust: nothing pulls a node along but what hits it
  scene.environment.gravity = scene::Vec3::Zero();
  const scene::Shape shapes[] = {scene::Sphere{0.01f}, scene::Capsule{.radius = 0.005f, .length = 0.3f},
                                 scene::Box{scene::Vec3(0.3f, 0.3f, 0.01f)}, octahedron()};
  const float speed = 25, step = speed / 72;
  for (const scene::Shape& shape : shapes) {
    Running running(scene);
    const auto at = [&](int tick) {
      return scene::Pose{scene::Vec3(0.002f, -0.317f, 0.61f - step * static_cast<float>(tick)),
                         scene::Quaternion::Identity()};
    };
    const std::vector<scene::Vec3> before = running.state().positions;
    for (int tick = 0; tick < 4; ++tick) running.tick(inputsOf(scene, {{shape, at(tick), at(tick + 1), 1}}));
    const NodeState after = running.state();
    const reference::Pose start = reference::toPose(at(0)), end = reference::toPose(at(4));
    int hit = 0, untouched = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      // Along its way the shape comes as near as this to where the node was.
      double nearest = 1;
      for (int k = 0; k <= 4000; ++k)
        nearest = std::min(nearest, reference::heightOver(shape, reference::between(start, end, k / 4000.0),
                                                          before[i].cast<double>()));
      if (nearest < -0.001) {
        ++hit;
        EXPECT_LT(after.velocities[i].z(), -1) << "shape " << shape.index() << " node " << i;
        EXPECT_LT(after.positions[i].z(), -0.05f) << "shape " << shape.index() << " node " << i;
      } else if (nearest > 0.02) {
        ++untouched;
        EXPECT_EQ(after.positions[i], before[i]);
      }
    }
    EXPECT_GE(hit, 1) << "shape " << shape.index();
    EXPECT_GT(untouched, 500) << "shape " << shape.index();
  }
}

TEST_F(Collision, aFastClothDoesNotPassThroughAThinShape) {
  scene::Scene scene = sceneOf({calmCloth(9, 9)});
  scene.cloths[0].structural = scene.cloths[0].shear = scene.cloths[0].bend = {};
  scene.cloths[0].damping = 0;
  scene.environment.gravity = scene::Vec3::Zero();
  const scene::Shape shapes[] = {scene::Box{scene::Vec3(1, 1, 0.002f)},
                                 scene::Capsule{.radius = 0.002f, .length = 1}};
  for (const scene::Shape& shape : shapes) {
    NodeState state = simulation::restState(scene.cloths);
    for (scene::Vec3& velocity : state.velocities) velocity.z() = 30;
    Running running(scene);
    running.restore(state);
    const scene::Pose pose{scene::Vec3(0, -0.08f, 0.1f), scene::Quaternion::Identity()};
    for (int tick = 0; tick < 2; ++tick) running.tick(inputsOf(scene, {resting(shape, pose)}));
    const NodeState after = running.state();
    // The middle column meets either; the first passes by the rod.
    for (std::size_t row = 0; row < 9; ++row) {
      EXPECT_LT(after.positions[9 * row + 4].z(), 0.1f) << "shape " << shape.index();
      EXPECT_NEAR(after.velocities[9 * row + 4].z(), 0, 1e-4);
    }
    EXPECT_EQ(after.positions[0].z() > 0.5f, std::holds_alternative<scene::Capsule>(shape));
  }
}

TEST_F(Collision, nodesStayOutsideOfEveryShapeAndComeToRest) {
  const scene::Shape shapes[] = {scene::Capsule{.radius = 0.08f, .length = 0.2f},
                                 scene::Box{scene::Vec3(0.2f, 0.2f, 0.2f)}, octahedron()};
  for (const scene::Shape& shape : shapes) {
    scene::Cloth cloth = lyingCloth(21, 21, 0.3f);
    cloth.thickness = 0.004f;
    cloth.damping = 3;
    cloth.friction = 0.6f;
    const scene::Scene scene = sceneOf({cloth});
    const scene::Pose pose{scene::Vec3(0.01f, 0.05f, 0), turned(25, scene::Vec3(1, 0.3f, 0.2f))};
    const scene::Pose floor{scene::Vec3(0, -0.2f, 0), scene::Quaternion::Identity()};
    Running running(scene);
    double deepest = 0;
    for (int tick = 0; tick < 360; ++tick) {
      running.tick(inputsOf(scene, {resting(shape, pose), resting(scene::Plane{}, floor)}));
      for (const scene::Vec3& position : running.state().positions) {
        deepest =
            std::max(deepest, double{cloth.thickness} - reference::heightOver(shape, reference::toPose(pose),
                                                                              position.cast<double>()));
        deepest = std::max(deepest, double{cloth.thickness} - (double{position.y()} + 0.2));
      }
    }
    double fastest = 0;
    for (const scene::Vec3& velocity : running.state().velocities)
      fastest = std::max(fastest, double{velocity.norm()});
    EXPECT_LT(deepest, 2e-6) << "shape " << shape.index();
    // From the capsule the sheet slides to the floor.
    if (!std::holds_alternative<scene::Capsule>(shape)) {
      EXPECT_LT(fastest, 0.005) << "shape " << shape.index();
    }
  }
}

// ---- Lists of what is near

// All kinds, in a cloud round the cloth; from where they are to a hand's breadth beside it.
std::vector<MovingCollider> cloud(std::size_t count, float size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return scene::Vec3(unit(random), unit(random), unit(random)); };
  std::vector<MovingCollider> colliders;
  for (std::size_t i = 0; i < count; ++i) {
    const scene::Shape shapes[] = {scene::Sphere{0.02f}, scene::Capsule{.radius = 0.01f, .length = 0.05f},
                                   scene::Box{scene::Vec3(0.03f, 0.02f, 0.04f)}, octahedron()};
    const scene::Pose start{size * vector(), turned(170 * unit(random), vector())};
    const scene::Pose end{start.position + 0.05f * vector(),
                          turned(60 * unit(random), vector()) * start.orientation};
    colliders.push_back({shapes[i % (i < 64 ? 4 : 3)], start, end, 1});
  }
  return colliders;
}

TEST_F(Collision, collidersThatAreFarAwayChangeNoBit) {
  const scene::Scene scene = sceneOf({calmCloth(40, 50)});
  std::vector<MovingCollider> near = cloud(40, 0.5f, 5), mixed;
  for (const MovingCollider& collider : near) {
    MovingCollider far = collider;
    far.start.position.x() += 7;
    far.end.position.x() += 7;
    mixed.insert(mixed.end(), 30, far);
    mixed.push_back(collider);
  }
  Running alone(scene), among(scene);
  for (int tick = 0; tick < 10; ++tick) {
    const simulation::TickStatus status = alone.tick(inputsOf(scene, near));
    ASSERT_TRUE(status.healthy);
    EXPECT_EQ(among.tick(inputsOf(scene, mixed)).stateHash, status.stateHash) << "tick " << tick;
  }
}

// Lists are made for runs of 64 nodes. With a rag of 21 before it, a cloth's nodes fall into other runs, one
// of which reaches from the rag to the cloth: lists that run over, nodes that leave the box that their list
// is good for, lists that serve, all give the same.
TEST_F(Collision, theRunsThatListsAreMadeForChangeNoBitHoweverMuchIsNear) {
  const scene::Cloth cloth = calmCloth(37, 29);
  scene::Cloth rag = calmCloth(3, 7);
  rag.name = "rag";
  rag.grid.pose.position = scene::Vec3(0.5f, 0.4f, 0.2f);
  const scene::Scene one = sceneOf({cloth}), two = sceneOf({rag, cloth});
  std::mt19937 random(9);
  const NodeState start = randomState(one, random, 0.004f, 8);
  NodeState both = simulation::restState(two.cloths);
  std::ranges::copy(start.positions, both.positions.begin() + 21);
  std::ranges::copy(start.velocities, both.velocities.begin() + 21);
  for (const std::size_t count : {3u, 60u, 700u}) {
    Running alone(one), shifted(two);
    alone.restore(start);
    shifted.restore(both);
    for (unsigned tick = 0; tick < 6; ++tick) {
      const std::vector<MovingCollider> colliders = cloud(count, 0.4f, tick);
      ASSERT_TRUE(alone.tick(inputsOf(one, colliders)).healthy);
      ASSERT_TRUE(shifted.tick(inputsOf(two, colliders)).healthy);
    }
    const NodeState expected = alone.state(), state = shifted.state();
    EXPECT_TRUE(
        std::equal(expected.positions.begin(), expected.positions.end(), state.positions.begin() + 21))
        << count << " colliders";
    EXPECT_TRUE(
        std::equal(expected.velocities.begin(), expected.velocities.end(), state.velocities.begin() + 21))
        << count << " colliders";
  }
}

TEST_F(Collision, asManyCollidersAsThereMayBeActAsInTheReference) {
  scene::Scene scene = sceneOf({calmCloth(12, 12)});
  scene.cloths[0].structural = scene.cloths[0].shear = scene.cloths[0].bend = {};
  scene.substeps = 1;
  scene.simulationRate = 720;
  std::vector<MovingCollider> colliders = cloud(simulation::kMaxColliders, 0.5f, 3);
  for (MovingCollider& collider : colliders) collider.end = collider.start;
  Running running(scene);
  reference::ReferenceSimulation reference(scene);
  setState(reference, running.state());
  running.tick(inputsOf(scene, colliders));
  reference.tick(referenceInputs(inputsOf(scene, colliders)));
  EXPECT_LT(largestDistance(running.state(), reference), 2e-6);
  EXPECT_GT(largestDistance(simulation::restState(scene.cloths), reference), 0.001);
}

// What falls on the ground and comes to rest has got back what gravity gave it: M g t. With every kernel that
// collides.
TEST_F(Collision, whatCollidersGiveToTheClothIsTold) {
  using enum scene::SolverKind;
  struct Kernel {
    scene::SolverKind solver = massSpring;
    scene::Integrator integrator = scene::Integrator::semiImplicitEuler;
    bool isMesh = false, selfCollides = false;
  };
  const Kernel kernels[] = {{},
                            {.isMesh = true},
                            {.integrator = scene::Integrator::rungeKutta4},
                            {.solver = constraint},
                            {.solver = acad, .isMesh = true},
                            {.solver = xpbd},
                            {.solver = implicitEuler},
                            {.selfCollides = true}};
  for (const Kernel& kernel : kernels) {
    scene::Cloth cloth = lyingCloth(5, 7, 0.02f);
    cloth.friction = 0;
    cloth.solver.kind = kernel.solver;
    if (kernel.solver == xpbd) cloth.solver.iterations = 1;
    if (kernel.isMesh) cloth = scene::asMesh(cloth);
    if (kernel.selfCollides) cloth.selfCollision = scene::SelfCollision{.radius = 0.008f};
    // Another, far above, that touches nothing.
    scene::Cloth above = lyingCloth(3, 3, 50);
    above.name = "above";
    scene::Scene scene = sceneOf({above, cloth});
    scene.integrator = kernel.integrator;
    Running running(scene), untold(scene);
    // Far below, and never touched.
    simulation::TickInputs inputs =
        inputsOf(scene, {resting(scene::Sphere{0.1f}, {scene::Vec3(0, -9, 0), scene::Quaternion::Identity()}),
                         resting(scene::Plane{}, {})});
    double impulse = 0;
    for (int tick = 0; tick < 36; ++tick) {
      inputs.tellsContacts = false;
      const std::uint64_t expected = untold.tick(inputs).stateHash;
      EXPECT_TRUE(untold.contacts().empty());
      inputs.tellsContacts = true;
      EXPECT_EQ(running.tick(inputs).stateHash, expected);
      for (const simulation::ContactStatus& contact : running.contacts()) {
        EXPECT_EQ(contact.collider, 1u);
        EXPECT_EQ(contact.cloth, 1u);
        impulse += contact.impulse;
      }
      // It falls 64 ms, four ticks and a half.
      if (tick == 3) {
        EXPECT_EQ(impulse, 0);
      }
    }
    const double expected = double{cloth.mass} * 9.81 * 36 / 72;
    EXPECT_NEAR(impulse, expected, 0.01 * expected) << static_cast<int>(kernel.solver);
  }
}

}  // namespace
}  // namespace clothstream::tests
