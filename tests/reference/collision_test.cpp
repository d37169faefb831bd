// SPDX-License-Identifier: MIT
// Spheres: contact, Coulomb friction, motion within a tick.
#include <cmath>

#include <gtest/gtest.h>

#include "server/reference/reference_simulation.h"
#include "tests/reference/cloths.h"

namespace clothstream::reference {
namespace {

model::Cloth patch(float friction) {
  model::Cloth cloth = sheet(2, 2);
  cloth.friction = friction;
  cloth.thickness = 0.01f;
  return cloth;
}

// Collides with a sphere that rests or moves with the given velocity. The nodes have not moved before.
void collideWithSphere(ReferenceCloth& cloth, const Vec3& centre, const Vec3& velocity, float radius,
                       double friction) {
  const ColliderStep step{.before = {centre}, .after = {centre}, .velocity = velocity, .spin = Vec3::Zero()};
  const std::vector<Vec3> from(cloth.positions().begin(), cloth.positions().end());
  cloth.collide(model::Sphere{radius}, step, friction, from);
  cloth.finishContacts(from);
}

TEST(ReferenceCollision, PutsNodesOnTheSurfacePlusThickness) {
  ReferenceCloth cloth(patch(0));
  cloth.positions()[0] = Vec3(0.3, 0, 0.4);
  cloth.positions()[1] = Vec3(5, 0, 0);
  collideWithSphere(cloth, Vec3::Zero(), Vec3::Zero(), 1, 1);
  EXPECT_LT((cloth.positions()[0] - 1.01 * Vec3(0.6, 0, 0.8)).norm(), 1e-8);  // 0.01 is a float
  EXPECT_EQ(cloth.positions()[1], Vec3(5, 0, 0));
}

TEST(ReferenceCollision, PushesANodeInTheCentreUp) {
  ReferenceCloth cloth(patch(0));
  cloth.positions()[0] = Vec3(1, 2, 3);
  collideWithSphere(cloth, Vec3(1, 2, 3), Vec3::Zero(), 1, 1);
  EXPECT_LT((cloth.positions()[0] - Vec3(1, 3.01, 3)).norm(), 1e-8);
}

TEST(ReferenceCollision, TakesTheApproachAndFrictionsShareOfTheSlide) {
  ReferenceCloth cloth(patch(0.5f));
  cloth.positions()[0] = Vec3(0, 0.9, 0);
  cloth.velocities()[0] = Vec3(3, -2, 4);
  collideWithSphere(cloth, Vec3::Zero(), Vec3::Zero(), 1, 0.8);
  // mu = 0.4, |rn| = 2: the slide of 5 m/s loses 0.8.
  EXPECT_LT((cloth.velocities()[0] - Vec3(3, 0, 4) * (4.2 / 5)).norm(), 1e-6);
}

TEST(ReferenceCollision, SticksWhereFrictionIsEnough) {
  ReferenceCloth cloth(patch(2));
  cloth.positions()[0] = Vec3(0, 0.9, 0);
  cloth.velocities()[0] = Vec3(3, -2, 0);
  collideWithSphere(cloth, Vec3::Zero(), Vec3(0, 0.5, 0), 1, 1);
  EXPECT_EQ(cloth.velocities()[0], Vec3(0, 0.5, 0));
}

TEST(ReferenceCollision, LeavesTheVelocityOfNodesThatLeave) {
  ReferenceCloth cloth(patch(1));
  cloth.positions()[0] = Vec3(0, 0.9, 0);
  cloth.velocities()[0] = Vec3(3, 2, 0);
  collideWithSphere(cloth, Vec3::Zero(), Vec3::Zero(), 1, 1);
  EXPECT_EQ(cloth.velocities()[0], Vec3(3, 2, 0));
}

// The top of a sphere of 1 km is nearly a plane. Gravity is tilted instead of the plane.
double slideOn(double slope, float friction, double seconds) {
  ReferenceCloth cloth(patch(friction));
  for (Vec3& position : cloth.positions()) position = Vec3(position.x(), 0.01, position.y() + 0.05);
  const model::Environment environment{
      .gravity =
          9.81f * model::Vec3(static_cast<float>(std::sin(slope)), -static_cast<float>(std::cos(slope)), 0),
      .airDensity = 0};
  const double h = 0.001;
  for (int i = 0; i < static_cast<int>(seconds / h); ++i) {
    cloth.integrate(environment, model::Integrator::semiImplicitEuler, h);
    collideWithSphere(cloth, Vec3(0, -1000, 0), Vec3::Zero(), 1000, 1);
  }
  return cloth.velocities()[0].x();
}

TEST(ReferenceFriction, HoldsOnASlopeBelowItsAngle) {
  EXPECT_NEAR(slideOn(std::atan(0.45), 0.5f, 1), 0, 1e-9);
}

TEST(ReferenceFriction, LetsSlideOnASlopeAboveItsAngle) {
  const double slope = std::atan(0.8);
  const double expected = 9.81 * (std::sin(slope) - 0.5 * std::cos(slope));
  EXPECT_NEAR(slideOn(slope, 0.5f, 1), expected, 0.01 * expected);
}

TEST(ReferenceTick, MovesASphereInAStraightLineOverItsSubsteps) {
  model::Scene scene;
  scene.cloths = {patch(0)};
  scene.cloths[0].structural = {};
  scene.environment = kWeightless;
  scene.substeps = 4;
  ReferenceSimulation simulation(scene);
  const TickInputs inputs{kWeightless, {{model::Sphere{0.5f}, {Vec3(0, 0, 0)}, {Vec3(0, 0, 4)}, 1}}};
  ReferenceCloth& cloth = simulation.cloths()[0];
  // At the end of substep 2 the sphere is at z = 3. Only this substep pushes a node just in front of its
  // pole.
  cloth.positions()[0] = Vec3(0, 0, 3.505);
  for (std::uint32_t substep = 0; substep < 2; ++substep) {
    simulation.substep(inputs, substep);
    EXPECT_EQ(cloth.positions()[0], Vec3(0, 0, 3.505));
  }
  simulation.substep(inputs, 2);
  EXPECT_NEAR(cloth.positions()[0].z(), 3.51, 1e-8);
  // The node has the speed of the sphere, 4 m per tick, and stays in front of it.
  simulation.substep(inputs, 3);
  EXPECT_NEAR(cloth.positions()[0].z(), 4.51, 1e-6);
}

TEST(ReferenceInputs, FollowTheScenesMotion) {
  model::Scene scene;
  scene.simulationRate = 10;
  scene.colliders.resize(1);
  scene.colliders[0].shape = model::Sphere{0.25f};
  scene.colliders[0].friction = 0.5f;
  scene.colliders[0].motion.keys = {{0, model::Vec3(0, 0, 0)}, {1, model::Vec3(8, 0, 0)}};
  const TickInputs inputs = inputsAt(scene, 5);
  ASSERT_EQ(inputs.colliders.size(), 1u);
  EXPECT_EQ(inputs.colliders[0].start.position, Vec3(4, 0, 0));
  EXPECT_EQ(inputs.colliders[0].end.position, model::poseAt(scene.colliders[0], 0.6).position.cast<double>());
  EXPECT_EQ(std::get<model::Sphere>(inputs.colliders[0].shape).radius, 0.25f);
  EXPECT_EQ(inputs.colliders[0].friction, 0.5);
}

}  // namespace
}  // namespace clothstream::reference
