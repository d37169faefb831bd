// SPDX-License-Identifier: MIT
// Cloth against every shape: slopes, spin and high speed. Lists of near colliders do not change the result.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::MovingCollider;
using simulation::NodeState;

class Collision : public GpuTest {};

MovingCollider resting(const model::Shape& shape, const model::Pose& pose) {
  return {shape, pose, pose, 1};
}

// A flat cloth at this height.
model::Cloth lyingCloth(std::uint32_t rows, std::uint32_t columns, float height) {
  model::Cloth cloth = calmCloth(rows, columns);
  cloth.grid.pose = {model::Vec3(0, height, -cloth.grid.height / 2), turned(-90, model::Vec3::UnitX())};
  cloth.damping = 0;
  cloth.thickness = 0;
  return cloth;
}

double meanAlong(const std::vector<model::Vec3>& vectors, const model::Vec3& direction) {
  double sum = 0;
  for (const model::Vec3& v : vectors) sum += v.cast<double>().dot(direction.cast<double>());
  return sum / static_cast<double>(vectors.size());
}

// A sheet on a slope of 30 degrees, tan 0.577: its speed after half a second.
double speedOnASlope(const model::Shape& shape, float friction) {
  model::Cloth cloth = lyingCloth(4, 4, 0);
  const model::Quaternion tilt = turned(-30, model::Vec3::UnitZ());  // down towards +X
  cloth.grid.pose = {tilt * cloth.grid.pose.position, tilt * cloth.grid.pose.orientation};
  cloth.friction = friction;
  const model::Scene scene = sceneOf({cloth});
  model::Pose pose{model::Vec3::Zero(), tilt};
  if (const auto* box = std::get_if<model::Box>(&shape))
    pose.position = tilt * model::Vec3(0, -box->size.y() / 2, 0);
  Running running(scene);
  for (int tick = 0; tick < 36; ++tick) running.tick(inputsOf(scene, {resting(shape, pose)}));
  return meanAlong(running.state().velocities, tilt * model::Vec3::UnitX());
}

TEST_F(Collision, ASheetOnASlopeSticksIfFrictionReachesItsTangent) {
  for (const model::Shape& shape :
       {model::Shape(model::Plane{}), model::Shape(model::Box{model::Vec3(8, 1, 8)})}) {
    EXPECT_NEAR(speedOnASlope(shape, 0.6f), 0, 1e-4);
    const double sliding = 9.81 * (std::sin(std::acos(-1.0) / 6) - 0.3 * std::cos(std::acos(-1.0) / 6)) * 0.5;
    EXPECT_NEAR(speedOnASlope(shape, 0.3f), sliding, 0.01 * sliding);
    EXPECT_NEAR(speedOnASlope(shape, 0), 9.81 * 0.5 * 0.5, 0.01 * 9.81 * 0.25);
  }
}

// Cloth on a shape that spins about Y rotates with it: friction carries it, and springs hold it together.
TEST_F(Collision, SpinCarriesTheCloth) {
  const float radius = 0.3f, rate = 1;  // rad/s
  const model::Shape shapes[] = {model::Sphere{radius},
                                 model::Capsule{.radius = 0.1f, .length = 2 * radius - 0.2f},
                                 model::Box{model::Vec3(0.5f, 2 * radius, 0.5f)}};
  for (const model::Shape& shape : shapes) {
    model::Cloth cloth = lyingCloth(5, 5, radius);
    cloth.damping = 1;
    cloth.friction = 1;
    const model::Scene scene = sceneOf({cloth});
    Running running(scene);
    const auto at = [&](int tick) {
      return model::Pose{
          model::Vec3::Zero(),
          turned(static_cast<float>(tick) / 72 * rate * 180 / std::acos(-1.0f), model::Vec3::UnitY())};
    };
    for (int tick = 0; tick < 144; ++tick)
      running.tick(inputsOf(scene, {{shape, at(tick), at(tick + 1), 1}}));
    const NodeState state = running.state();
    double spin = 0;
    for (const std::size_t corner : {0u, 4u, 20u, 24u}) {
      const model::Vec3 arm = state.positions[corner], velocity = state.velocities[corner];
      spin += double{(arm.z() * velocity.x() - arm.x() * velocity.z()) /
                     (arm.x() * arm.x() + arm.z() * arm.z())} /
              4;
    }
    EXPECT_NEAR(spin, double{rate}, 0.1) << "shape " << shape.index();
  }
}

// At 25 m/s a shape moves 35 mm in a substep, several times its thickness. It must carry the nodes that it
// hits in front of it, and pass through none.
TEST_F(Collision, AFastThinShapeDoesNotPassThroughTheCloth) {
  model::Scene scene = sceneOf({calmCloth(33, 33)});
  model::Cloth& cloth = scene.cloths[0];
  cloth.structural = cloth.shear = cloth.bend = {};  // dust: only contacts move a node
  scene.environment.gravity = model::Vec3::Zero();
  const model::Shape shapes[] = {model::Sphere{0.01f}, model::Capsule{.radius = 0.005f, .length = 0.3f},
                                 model::Box{model::Vec3(0.3f, 0.3f, 0.01f)}, octahedron(),
                                 model::Capsule{.radius = 0.01f, .length = 0.3f, .topRadius = 0.004f}};
  const float speed = 25, step = speed / 72;
  for (const model::Shape& shape : shapes) {
    Running running(scene);
    const auto at = [&](int tick) {
      return model::Pose{model::Vec3(0.002f, -0.317f, 0.61f - step * static_cast<float>(tick)),
                         model::Quaternion::Identity()};
    };
    const std::vector<model::Vec3> before = running.state().positions;
    for (int tick = 0; tick < 4; ++tick) running.tick(inputsOf(scene, {{shape, at(tick), at(tick + 1), 1}}));
    const NodeState after = running.state();
    const reference::Pose start = reference::toPose(at(0)), end = reference::toPose(at(4));
    int hit = 0, untouched = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      // `nearest` is the smallest distance from the moving shape to the first position of the node.
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

TEST_F(Collision, AFastClothDoesNotPassThroughAThinShape) {
  model::Scene scene = sceneOf({calmCloth(9, 9)});
  scene.cloths[0].structural = scene.cloths[0].shear = scene.cloths[0].bend = {};
  scene.cloths[0].damping = 0;
  scene.environment.gravity = model::Vec3::Zero();
  const model::Shape shapes[] = {model::Box{model::Vec3(1, 1, 0.002f)},
                                 model::Capsule{.radius = 0.002f, .length = 1},
                                 model::Capsule{.radius = 0.002f, .length = 1, .topRadius = 0.003f}};
  for (const model::Shape& shape : shapes) {
    NodeState state = simulation::restState(scene.cloths);
    for (model::Vec3& velocity : state.velocities) velocity.z() = 30;
    Running running(scene);
    running.restore(state);
    const model::Pose pose{model::Vec3(0, -0.08f, 0.1f), model::Quaternion::Identity()};
    for (int tick = 0; tick < 2; ++tick) running.tick(inputsOf(scene, {resting(shape, pose)}));
    const NodeState after = running.state();
    // The middle column meets either; the first passes by the rod.
    for (std::size_t row = 0; row < 9; ++row) {
      EXPECT_LT(after.positions[9 * row + 4].z(), 0.1f) << "shape " << shape.index();
      EXPECT_NEAR(after.velocities[9 * row + 4].z(), 0, 1e-4);
    }
    EXPECT_EQ(after.positions[0].z() > 0.5f, std::holds_alternative<model::Capsule>(shape));
  }
}

TEST_F(Collision, NodesStayOutsideEveryShapeAndComeToRest) {
  const model::Shape shapes[] = {model::Capsule{.radius = 0.08f, .length = 0.2f},
                                 model::Capsule{.radius = 0.04f, .length = 0.2f, .topRadius = 0.1f},
                                 model::Box{model::Vec3(0.2f, 0.2f, 0.2f)}, octahedron()};
  for (const model::Shape& shape : shapes) {
    model::Cloth cloth = lyingCloth(21, 21, 0.3f);
    cloth.thickness = 0.004f;
    cloth.damping = 3;
    cloth.friction = 0.6f;
    const model::Scene scene = sceneOf({cloth});
    const model::Pose pose{model::Vec3(0.01f, 0.05f, 0), turned(25, model::Vec3(1, 0.3f, 0.2f))};
    const model::Pose floor{model::Vec3(0, -0.2f, 0), model::Quaternion::Identity()};
    Running running(scene);
    double deepest = 0;
    for (int tick = 0; tick < 360; ++tick) {
      running.tick(inputsOf(scene, {resting(shape, pose), resting(model::Plane{}, floor)}));
      for (const model::Vec3& position : running.state().positions) {
        deepest =
            std::max(deepest, double{cloth.thickness} - reference::heightOver(shape, reference::toPose(pose),
                                                                              position.cast<double>()));
        deepest = std::max(deepest, double{cloth.thickness} - (double{position.y()} + 0.2));
      }
    }
    double fastest = 0;
    for (const model::Vec3& velocity : running.state().velocities)
      fastest = std::max(fastest, double{velocity.norm()});
    EXPECT_LT(deepest, 2e-6) << "shape " << shape.index();
    // From a capsule the sheet slides to the floor.
    if (!std::holds_alternative<model::Capsule>(shape)) {
      EXPECT_LT(fastest, 0.005) << "shape " << shape.index();
    }
  }
}

// ---- Lists of near colliders

// Shapes of all kinds in a cloud around the cloth, from its position to 10 cm away.
std::vector<MovingCollider> cloud(std::size_t count, float size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return model::Vec3(unit(random), unit(random), unit(random)); };
  std::vector<MovingCollider> colliders;
  for (std::size_t i = 0; i < count; ++i) {
    const model::Shape shapes[] = {model::Sphere{0.02f}, model::Capsule{.radius = 0.01f, .length = 0.05f},
                                   model::Box{model::Vec3(0.03f, 0.02f, 0.04f)}, octahedron()};
    const model::Pose start{size * vector(), turned(170 * unit(random), vector())};
    const model::Pose end{start.position + 0.05f * vector(),
                          turned(60 * unit(random), vector()) * start.orientation};
    colliders.push_back({shapes[i % (i < 64 ? 4 : 3)], start, end, 1});
  }
  return colliders;
}

TEST_F(Collision, FarCollidersChangeNoBit) {
  const model::Scene scene = sceneOf({calmCloth(40, 50)});
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

// Each run of 16 nodes has a list. A rag of 21 nodes before the cloth shifts its nodes into other runs, and
// one run then holds nodes of both. The result is the same for lists that overflow, for nodes that leave the
// box of their list, and for lists that are valid.
TEST_F(Collision, ListsOfNearCollidersChangeNoBit) {
  const model::Cloth cloth = calmCloth(37, 29);
  model::Cloth rag = calmCloth(3, 7);
  rag.name = "rag";
  rag.grid.pose.position = model::Vec3(0.5f, 0.4f, 0.2f);
  const model::Scene one = sceneOf({cloth}), two = sceneOf({rag, cloth});
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

TEST_F(Collision, TheMaximumNumberOfCollidersActsAsInTheReference) {
  model::Scene scene = sceneOf({calmCloth(12, 12)});
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

// A cloth that falls on the ground and comes to rest has received the impulse of gravity, M g t, from it. The
// test covers every kernel that collides.
TEST_F(Collision, ReportsTheImpulsesOfColliders) {
  using enum model::SolverKind;
  struct Kernel {
    model::SolverKind solver = massSpring;
    model::Integrator integrator = model::Integrator::semiImplicitEuler;
    bool isMesh = false, selfCollides = false;
  };
  const Kernel kernels[] = {{},
                            {.isMesh = true},
                            {.integrator = model::Integrator::rungeKutta4},
                            {.solver = constraint},
                            {.solver = acad, .isMesh = true},
                            {.solver = xpbd},
                            {.solver = implicitEuler},
                            {.selfCollides = true}};
  for (const Kernel& kernel : kernels) {
    model::Cloth cloth = lyingCloth(5, 7, 0.02f);
    cloth.friction = 0;
    cloth.solver.kind = kernel.solver;
    if (kernel.solver == xpbd) cloth.solver.iterations = 1;
    if (kernel.isMesh) cloth = model::asMesh(cloth);
    if (kernel.selfCollides) cloth.selfCollision = model::SelfCollision{.radius = 0.008f};
    // Another cloth far above, which touches nothing.
    model::Cloth above = lyingCloth(3, 3, 50);
    above.name = "above";
    model::Scene scene = sceneOf({above, cloth});
    scene.integrator = kernel.integrator;
    Running running(scene), silent(scene);
    // The sphere is far below and never touched.
    simulation::TickInputs inputs =
        inputsOf(scene, {resting(model::Sphere{0.1f}, {model::Vec3(0, -9, 0), model::Quaternion::Identity()}),
                         resting(model::Plane{}, {})});
    double impulse = 0;
    for (int tick = 0; tick < 36; ++tick) {
      inputs.reportsContacts = false;
      const std::uint64_t expected = silent.tick(inputs).stateHash;
      EXPECT_TRUE(silent.contacts().empty());
      inputs.reportsContacts = true;
      EXPECT_EQ(running.tick(inputs).stateHash, expected);
      for (const simulation::ContactStatus& contact : running.contacts()) {
        EXPECT_EQ(contact.collider, 1u);
        EXPECT_EQ(contact.cloth, 1u);
        impulse += contact.impulse;
      }
      // The cloth falls for 64 ms, which is four and a half ticks.
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
