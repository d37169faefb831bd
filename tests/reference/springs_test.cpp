// SPDX-License-Identifier: MIT
// The reference compared with closed forms (free fall, one spring, a hanging column) and conservation laws.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "server/reference/reference_simulation.h"
#include "tests/reference/cloths.h"

namespace clothstream::reference {
namespace {

using model::Integrator;

model::GridRange topRow(std::uint32_t columns) {
  return {.firstColumn = 0, .lastColumn = columns - 1};
}

model::Cloth withoutSprings(model::Cloth cloth) {
  cloth.structural = cloth.shear = cloth.bend = {};
  return cloth;
}

TEST(ReferenceFreeFall, IsThatOfTheIntegrator) {
  const model::Environment environment{.airDensity = 0};
  const double g = environment.gravity.y(), h = 0.001;
  const int n = 1000;
  for (const Integrator integrator : {Integrator::semiImplicitEuler, Integrator::explicitEuler}) {
    // Explicit Euler would amplify the small stretch that the rounding of rest positions leaves in the
    // springs.
    ReferenceCloth cloth(integrator == Integrator::explicitEuler ? withoutSprings(sheet(6, 5))
                                                                 : sheetWithAllSprings(6, 5));
    const std::vector<Vec3> start(cloth.positions().begin(), cloth.positions().end());
    for (int i = 0; i < n; ++i) cloth.integrate(environment, integrator, h);
    // Sum of the velocities 1..n, or 0..n-1, times h.
    const double fallen = 0.5 * g * h * h * n * (integrator == Integrator::semiImplicitEuler ? n + 1 : n - 1);
    // With the other integrator the springs swing by that rounding, some 1e-8 m.
    for (std::size_t i = 0; i < start.size(); ++i)
      EXPECT_LT((cloth.positions()[i] - start[i] - Vec3(0, fallen, 0)).norm(), 1e-6);
  }
}

TEST(ReferenceSpring, SwingsWithItsPeriod) {
  model::Cloth model = sheet(2, 2);
  model.pins = {topRow(2)};
  ReferenceCloth cloth(model);
  const double rest = cloth.positions()[2].y();
  for (const std::size_t node : {2u, 3u}) cloth.positions()[node].y() -= 0.02;
  const double period = 2 * std::numbers::pi * std::sqrt(cloth.masses()[0] / model.structural.stiffness);
  const double h = period / 500;
  int steps = 0;
  double last = 0;
  for (int crossings = 0; crossings < 20; ++steps) {
    const double before = cloth.positions()[2].y() - rest;
    cloth.integrate(kWeightless, Integrator::semiImplicitEuler, h);
    const double after = cloth.positions()[2].y() - rest;
    if (before * after <= 0) {
      ++crossings;
      last = (steps + before / (before - after)) * h;  // the first crossing is after a quarter
    }
  }
  EXPECT_NEAR(last / (period * 9.75), 1, 0.005);
}

TEST(ReferenceColumn, StretchesEachLinkByTheWeightBelowIt) {
  model::Cloth model = sheet(10, 2);
  model.pins = {topRow(2)};
  model.damping = 4;
  ReferenceCloth cloth(model);
  const model::Environment environment{.airDensity = 0};
  // The slowest mode, pi/2 sqrt(k/m)/N = 17 1/s, decays with 2 1/s: after 20 s by e^-40.
  for (int i = 0; i < 20000; ++i) cloth.integrate(environment, Integrator::semiImplicitEuler, 0.001);
  for (std::size_t link = 1; link < 10; ++link) {
    const double length = (cloth.positions()[2 * link] - cloth.positions()[2 * link - 2]).norm();
    const double below = static_cast<double>(10 - link);
    const double expected = below * cloth.masses()[0] * 9.81 / model.structural.stiffness;
    EXPECT_NEAR(length - 0.1, expected, 0.001 * expected) << "link " << link;
  }
}

TEST(ReferenceSprings, ExertNoTotalForceAndNoTotalTorque) {
  ReferenceCloth cloth(sheetWithAllSprings(9, 7));
  shake(cloth, 0.05, 1);
  std::vector<Vec3> forces(cloth.nodeCount(), Vec3::Zero());
  cloth.accumulateSpringForces(forces);
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  double scale = 0;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    force += forces[i];
    torque += cloth.positions()[i].cross(forces[i]);
    scale += forces[i].norm();
  }
  ASSERT_GT(scale, 1);
  // Rounding of a few hundred sums.
  EXPECT_LT(force.norm(), 1e-13 * scale);
  EXPECT_LT(torque.norm(), 1e-13 * scale);
}

TEST(ReferenceSprings, PullWithTheGradientOfTheirEnergy) {
  model::Cloth model = sheetWithAllSprings(5, 6);
  model.structural.damping = model.shear.damping = model.bend.damping = 0;
  ReferenceCloth cloth(model);
  shake(cloth, 0.03, 0);
  std::vector<Vec3> forces(cloth.nodeCount(), Vec3::Zero());
  cloth.accumulateSpringForces(forces);
  const double delta = 1e-6;
  for (std::size_t i = 0; i < cloth.nodeCount(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      double& x = cloth.positions()[i][axis];
      const double at = x;
      x = at + delta;
      const double above = cloth.elasticEnergy();
      x = at - delta;
      const double below = cloth.elasticEnergy();
      x = at;
      // Central differences: error k delta^2/L^2 in theory, energy rounding 1e-16 / delta in practice.
      EXPECT_NEAR(forces[i][axis], -(above - below) / (2 * delta), 1e-6);
    }
}

TEST(ReferenceSprings, DampOnlyAlongTheirLength) {
  model::Cloth model = sheet(2, 2);
  model.structural = {0, 2};
  ReferenceCloth cloth(model);
  cloth.velocities()[1] = Vec3(3, 5, 7);
  std::vector<Vec3> forces(4, Vec3::Zero());
  cloth.accumulateSpringForces(forces);
  EXPECT_LT((forces[0] - Vec3(6, 0, 0)).norm(), 1e-12);     // from node 1, to its right
  EXPECT_LT((forces[1] - Vec3(-6, -10, 0)).norm(), 1e-12);  // and from node 3, below it
  EXPECT_LT((forces[3] - Vec3(0, 10, 0)).norm(), 1e-12);
}

// As on the device (tests/simulation/behaviour_test.cpp), without rounding.
TEST(ReferenceEnergy, VariesByItsBoundFor100000StepsOfOneSpring) {
  model::Cloth model = sheet(2, 2);
  model.pins = {topRow(2)};
  ReferenceCloth cloth(model);
  for (const std::size_t node : {2u, 3u}) cloth.positions()[node].y() -= 0.02;
  const double omega = std::sqrt(model.structural.stiffness / cloth.masses()[0]);
  const double h = 2 * std::numbers::pi / omega / 500, start = cloth.elasticEnergy();
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    cloth.integrate(kWeightless, Integrator::semiImplicitEuler, h);
    worst = std::max(worst, std::abs(cloth.kineticEnergy() + cloth.elasticEnergy() - start));
  }
  EXPECT_NEAR(worst / start, omega * h / 2, 0.1 * omega * h / 2);
}

TEST(ReferenceEnergy, DriftsByLessThanTwoPercentWithoutDamping) {
  model::Cloth model = sheetWithAllSprings(8, 8);
  model.structural.damping = model.shear.damping = model.bend.damping = 0;
  model.pins = {topRow(8)};
  ReferenceCloth cloth(model);
  shake(cloth, 0, 0.5);
  const model::Environment environment{.airDensity = 0};
  const auto energy = [&] {
    return cloth.kineticEnergy() + cloth.elasticEnergy() +
           cloth.gravityEnergy(environment.gravity.cast<double>());
  };
  const double start = energy();
  // Energy that can turn into motion: the sheet sags and swings by about its stretch under its own weight.
  const double scale = cloth.kineticEnergy();
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    cloth.integrate(environment, Integrator::semiImplicitEuler, 0.0002);
    worst = std::max(worst, std::abs(energy() - start));
  }
  EXPECT_LT(worst, 0.02 * scale);
}

TEST(ReferenceEnergy, OnlyFallsWithDamping) {
  ReferenceCloth cloth(sheetWithAllSprings(8, 8));
  shake(cloth, 0.01, 0.5);
  double before = cloth.kineticEnergy() + cloth.elasticEnergy();
  const double start = before;
  for (int block = 0; block < 20; ++block) {
    for (int i = 0; i < 100; ++i) cloth.integrate(kWeightless, Integrator::semiImplicitEuler, 0.0005);
    const double now = cloth.kineticEnergy() + cloth.elasticEnergy();
    EXPECT_LT(now, before);
    before = now;
  }
  EXPECT_LT(before, 0.8 * start);
}

TEST(ReferencePins, NeverMove) {
  model::Cloth model = sheetWithAllSprings(6, 6);
  model.pins = {
      {.firstRow = 0, .lastRow = 5, .rowStep = 5, .firstColumn = 0, .lastColumn = 5, .columnStep = 5}};
  model.drag = 1;
  model::Scene scene;
  scene.cloths = {model};
  scene.environment.wind = model::Vec3(0, 0, 5);
  scene.colliders.resize(1);
  scene.colliders[0].shape = model::Sphere{10};
  ReferenceSimulation simulation(scene);
  for (int i = 0; i < 20; ++i) simulation.tick();
  const std::vector<model::Vec3> rest = model::restPositions(model.grid);
  for (const std::size_t corner : {0u, 5u, 30u, 35u}) {
    EXPECT_EQ(simulation.cloths()[0].positions()[corner], rest[corner].cast<double>());
    EXPECT_EQ(simulation.cloths()[0].velocities()[corner], Vec3::Zero());
  }
}

TEST(ReferenceSymmetry, IsKeptByASheetOnASphere) {
  model::Scene scene;
  model::Cloth model = sheetWithAllSprings(11, 11);
  model.grid.pose = {model::Vec3(0, 0.6f, -0.5f), model::Quaternion(std::sqrt(0.5f), -std::sqrt(0.5f), 0, 0)};
  model.damping = 2;
  scene.cloths = {model};
  scene.colliders.resize(1);
  scene.colliders[0].shape = model::Sphere{0.3f};
  scene.environment.airDensity = 0;
  ReferenceSimulation simulation(scene);
  for (int i = 0; i < 36; ++i) simulation.tick();
  const auto positions = simulation.cloths()[0].positions();
  EXPECT_LT(positions[0].y(), 0.3);  // it drapes
  for (std::size_t row = 0; row < 11; ++row)
    for (std::size_t column = 0; column < 11; ++column) {
      const Vec3& left = positions[row * 11 + column];
      const Vec3& right = positions[row * 11 + 10 - column];
      // Start positions are symmetric; only rounding is not, and half a second of buckling amplifies it.
      EXPECT_LT((left - Vec3(-right.x(), right.y(), right.z())).norm(), 1e-6);
    }
}

TEST(ReferenceStrain, IsThatOfAUniformStretch) {
  ReferenceCloth cloth(sheetWithAllSprings(4, 4));
  EXPECT_NEAR(cloth.strain().max, 0, 1e-6);
  for (Vec3& position : cloth.positions()) position *= 1.1;
  EXPECT_NEAR(cloth.strain().max, 0.1, 1e-6);
  EXPECT_NEAR(cloth.strain().mean, 0.1, 1e-6);
}

TEST(ReferenceParameters, HoldFromTheNextStep) {
  ReferenceCloth cloth(sheet(3, 3));
  for (Vec3& position : cloth.positions()) position *= 2;
  const double before = cloth.elasticEnergy();
  model::Cloth stiffer = sheet(3, 3);
  stiffer.structural.stiffness *= 3;
  cloth.setParameters(stiffer);
  EXPECT_NEAR(cloth.elasticEnergy(), 3 * before, 1e-12);
}

}  // namespace
}  // namespace clothstream::reference
