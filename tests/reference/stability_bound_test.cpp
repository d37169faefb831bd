// SPDX-License-Identifier: MIT
// The stability bound of server/model compared with runs of the reference.
#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "server/model/stability.h"
#include "server/reference/reference_cloth.h"
#include "tests/reference/cloths.h"

namespace clothstream::reference {
namespace {

using model::Integrator;

model::Scene stretched(Integrator integrator) {
  model::Scene scene;
  scene.simulationRate = 10;
  scene.integrator = integrator;
  scene.environment = kWeightless;
  scene.cloths = {sheetWithAllSprings(12, 10)};
  return scene;
}

// Stretches the cloth by 5 % in its plane and displaces its nodes by up to 1e-6 m. The two outer rows and
// columns on each side are pinned, because bend springs reach that far. The other nodes are in balance.
ReferenceCloth stretchedCloth(model::Cloth model) {
  const std::uint32_t row = model.grid.rows - 1, column = model.grid.columns - 1;
  model.pins = {{.firstRow = 0, .lastRow = 1, .firstColumn = 0, .lastColumn = column},
                {.firstRow = row - 1, .lastRow = row, .firstColumn = 0, .lastColumn = column},
                {.firstRow = 0, .lastRow = row, .firstColumn = 0, .lastColumn = 1},
                {.firstRow = 0, .lastRow = row, .firstColumn = column - 1, .lastColumn = column}};
  ReferenceCloth cloth(model);
  for (Vec3& position : cloth.positions()) position *= 1.05;
  shake(cloth, 1e-6, 0);
  return cloth;
}

double energyAfter(ReferenceCloth& cloth, Integrator integrator, double h, int steps) {
  for (int i = 0; i < steps; ++i) cloth.integrate(kWeightless, integrator, h);
  return cloth.kineticEnergy();
}

// The energy is a hundred thousand times that of the displacement, or is not finite.
bool diverges(double energy) {
  return !(energy < 1e-3);
}

// Largest eigenvalue of M^-1 K, by power iteration on differences of the forces.
double largestEigenvalue(ReferenceCloth cloth) {
  const std::size_t nodes = cloth.nodeCount();
  const std::vector<Vec3> at(cloth.positions().begin(), cloth.positions().end());
  const auto forcesAt = [&](const std::vector<Vec3>& direction, double step) {
    for (std::size_t i = 0; i < nodes; ++i) cloth.positions()[i] = at[i] + step * direction[i];
    std::vector<Vec3> forces(nodes, Vec3::Zero());
    cloth.accumulateSpringForces(forces);
    return forces;
  };
  std::vector<Vec3> mode(nodes, Vec3::Zero());
  for (std::size_t i = 0; i < nodes; ++i)
    if (cloth.inverseMasses()[i] > 0)
      mode[i] = Vec3(std::sin(3.1 * static_cast<double>(i)), std::cos(2.9 * static_cast<double>(i)), 0.1);
  double eigenvalue = 0;
  for (int iteration = 0; iteration < 2000; ++iteration) {
    const std::vector<Vec3> ahead = forcesAt(mode, 1e-5), behind = forcesAt(mode, -1e-5);
    double square = 0;
    for (std::size_t i = 0; i < nodes; ++i) {
      mode[i] = (behind[i] - ahead[i]) / 2e-5 * cloth.inverseMasses()[i];
      square += mode[i].squaredNorm();
    }
    eigenvalue = std::sqrt(square);
    for (Vec3& x : mode) x /= eigenvalue;
  }
  return eigenvalue;
}

TEST(StabilityBound, KeepsSemiImplicitEulerBounded) {
  model::Scene scene = stretched(Integrator::semiImplicitEuler);
  const std::uint32_t substeps = model::stableSubsteps(scene);
  ASSERT_GT(substeps, 1u);
  ReferenceCloth cloth = stretchedCloth(scene.cloths[0]);
  // Shaken by 1e-6 m, springs of 100 N/m hold some 1e-8 J in 120 nodes.
  EXPECT_LT(energyAfter(cloth, scene.integrator, scene.tickSeconds() / substeps, 20000), 1e-7);
}

TEST(StabilityBound, IsBelowTheTrueLimit) {
  model::Scene scene = stretched(Integrator::semiImplicitEuler);
  for (model::Spring* spring : {&scene.cloths[0].structural, &scene.cloths[0].shear, &scene.cloths[0].bend})
    spring->damping = 0;
  const std::uint32_t substeps = model::stableSubsteps(scene);
  const double bound = scene.tickSeconds() / substeps;
  const double limit = 2 / std::sqrt(largestEigenvalue(stretchedCloth(scene.cloths[0])));
  EXPECT_LT(bound, limit);
  EXPECT_GT(bound, 0.5 * limit);  // the bound is within a factor of two of the limit
  ReferenceCloth below = stretchedCloth(scene.cloths[0]), above = below;
  EXPECT_LT(energyAfter(below, scene.integrator, 0.98 * limit, 5000), 1e-6);
  EXPECT_TRUE(diverges(energyAfter(above, scene.integrator, 1.1 * limit, 1000)));
}

TEST(StabilityBound, IsBelowTheTrueLimitOfRungeKutta) {
  model::Scene scene = stretched(Integrator::rungeKutta4);
  for (model::Spring* spring : {&scene.cloths[0].structural, &scene.cloths[0].shear, &scene.cloths[0].bend})
    spring->damping = 0;
  const double bound = scene.tickSeconds() / model::stableSubsteps(scene);
  // On the imaginary axis the method is stable up to 2 sqrt(2).
  const double limit = 2 * std::sqrt(2.0) / std::sqrt(largestEigenvalue(stretchedCloth(scene.cloths[0])));
  EXPECT_LT(bound, limit);
  EXPECT_GT(bound, 0.5 * limit);
  ReferenceCloth below = stretchedCloth(scene.cloths[0]), above = below;
  EXPECT_LT(energyAfter(below, scene.integrator, 0.98 * limit, 5000), 1e-6);
  EXPECT_TRUE(diverges(energyAfter(above, scene.integrator, 1.1 * limit, 1000)));
}

// The assumption of the bound: in the half disc of radius 2.61, in which the product of every mode's step and
// rate lies, the amplification of the method is at most 1.
TEST(StabilityBound, LiesWithinTheRegionOfRungeKutta) {
  for (double radius = 0.01; radius <= 2.61; radius += 0.01)
    for (int i = 0; i <= 360; ++i) {
      const std::complex<double> z = std::polar(radius, M_PI * (0.5 + i / 360.0));
      ASSERT_LE(std::abs(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))), 1 + 1e-12) << z;
    }
}

// Compared with the exact motion of a spring, the error after a given time falls by 2^4 if the step is
// halved.
TEST(RungeKutta, ErrsWithTheFourthPowerOfTheStep) {
  model::Cloth model = sheetWithAllSprings(2, 2);
  model.shear = model.bend = {};
  model.structural.damping = 0;
  model.damping = 0;
  model.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = 1}};
  const double omega = std::sqrt(double{model.structural.stiffness} / (double{model.mass} / 4));
  const auto errorWith = [&](int steps) {
    ReferenceCloth cloth(model);
    const double time = 5 / omega, stretch = 0.1 * double{model.grid.height};
    const double rest = cloth.positions()[2].y();
    for (const std::size_t node : {2, 3}) cloth.positions()[node].y() -= stretch;
    for (int i = 0; i < steps; ++i) cloth.integrate(kWeightless, Integrator::rungeKutta4, time / steps);
    return std::abs(rest - cloth.positions()[2].y() - stretch * std::cos(5.0));
  };
  EXPECT_NEAR(errorWith(50) / errorWith(100), 16, 1);
  EXPECT_GT(errorWith(50), 0);
}

TEST(StabilityBound, KeepsExplicitEulerBounded) {
  model::Scene scene = stretched(Integrator::explicitEuler);
  model::Cloth& cloth = scene.cloths[0];
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0.2f;
  cloth.damping = 20;
  const std::uint32_t substeps = model::stableSubsteps(scene);
  ASSERT_GT(substeps, 1u);
  const double h = scene.tickSeconds() / substeps;
  ReferenceCloth damped = stretchedCloth(cloth);
  EXPECT_LT(energyAfter(damped, scene.integrator, h, 20000), 1e-7);
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0;
  cloth.damping = 0;
  EXPECT_EQ(model::stableSubsteps(scene), 0u);
  ReferenceCloth undamped = stretchedCloth(cloth);
  EXPECT_TRUE(diverges(energyAfter(undamped, scene.integrator, h, 20000)));
}

}  // namespace
}  // namespace clothstream::reference
