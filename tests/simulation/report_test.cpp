// SPDX-License-Identifier: MIT
// The report of a tick: its values compared with the double-precision reference, its bits, and that it does
// not change the simulation.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "server/model/springs.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::ClothReport;
using simulation::NodeState;

class Report : public GpuTest {};

std::vector<std::byte> bitsOf(const std::vector<ClothReport>& reports) {
  std::vector<std::byte> bits(reports.size() * sizeof(ClothReport));
  std::memcpy(bits.data(), reports.data(), bits.size());
  return bits;
}

// Tolerances of the report on an exactly known state: the rounding of the kernel.
//
// A stretch: differences of positions are rounded (3 kRounding of the square), as are the two squares and
// what is computed from them (reciprocals to 1e-6 of the extension): 6 kRounding + 2e-6 of it. A sum: at most
// `adds` roundings of what is summed so far, which is at most the sum of the absolute terms; a term is good
// to 1e-5 of itself (products, a reciprocal of the mass), an elastic one to twice the error of its extension
// besides. 64 nodes of a run have at most 6 springs each, other runs and lanes follow: 400 adds.
void expectAsReference(const ClothReport& report, const reference::ReferenceCloth& cloth,
                       const model::Cloth& definition, const model::Vec3& gravity) {
  const reference::Strain strain = cloth.strain();
  constexpr double kStretch = 6 * kRounding;
  constexpr double kAdds = 400 * kRounding, kTerm = 1e-5;
  EXPECT_NEAR(report.strainMax, strain.max, kStretch + 2e-6 * std::abs(strain.max));
  EXPECT_NEAR(report.strainMean, strain.mean, kStretch + (kAdds + kTerm) * strain.mean);
  // Upper end of the bin, but at most the largest strain.
  EXPECT_GE(report.strainP99, strain.p99 - kStretch - 2e-6 * std::abs(strain.p99));
  EXPECT_LE(report.strainP99, std::max(strain.p99 * (1 + 1.0 / 32), 1e-6) + kStretch + 2e-6);
  EXPECT_LE(report.strainP99, report.strainMax);

  EXPECT_NEAR(report.kineticEnergy, cloth.kineticEnergy(), (kAdds + kTerm) * cloth.kineticEnergy());
  double heights = 0;  // of the absolute terms
  for (std::size_t i = 0; i < cloth.positions().size(); ++i)
    if (cloth.inverseMasses()[i] > 0)
      heights += cloth.masses()[i] * gravity.cast<double>().cwiseAbs().dot(cloth.positions()[i].cwiseAbs());
  EXPECT_NEAR(report.gravityEnergy, cloth.gravityEnergy(gravity.cast<double>()), (kAdds + kTerm) * heights);
  double extensions = 0;  // what an error of kStretch in each does: k e de
  for (const model::SpringLink& link : model::springLinks(definition)) {
    const double length = (cloth.positions()[link.b] - cloth.positions()[link.a]).norm();
    const double error = kStretch * link.restLength;
    extensions += model::springOf(definition, link.kind).stiffness * error *
                  (std::abs(length - double{link.restLength}) + error);
  }
  EXPECT_NEAR(report.elasticEnergy, cloth.elasticEnergy(),
              (kAdds + kTerm) * cloth.elasticEnergy() + extensions);
}

// More nodes than a block, and fewer than a run has; meshes between grids; pinned ones.
model::Scene reportedScene() {
  model::Cloth large = calmCloth(71, 67);
  large.pins = {topRow(large)};
  large.grid.pose.position = model::Vec3(0.3f, 0.2f, -0.4f);
  model::Cloth disc = discCloth(12);
  disc.pinnedVertices = {3, 4};
  model::Cloth small = calmCloth(2, 2);
  model::Cloth wide = calmCloth(2, 90);
  wide.structural.stiffness = 150;
  model::Cloth dish = discCloth(3);
  model::Scene scene = sceneOf({large, disc, small, wide, dish});
  scene.environment.gravity = model::Vec3(1, -9.81f, 0.5f);
  return scene;
}

TEST_F(Report, MatchesTheReferenceOnRandomStates) {
  const model::Scene scene = reportedScene();
  Running running(scene);
  std::mt19937 random(11);
  for (const float displacement : {0.004f, 0.0002f, 0.0f}) {
    running.restore(randomState(scene, random, displacement, 0.5f));
    const std::vector<ClothReport> reports = running.tickAndReport(inputsOf(scene));
    reference::ReferenceSimulation reference(scene);
    setState(reference, running.state());
    ASSERT_EQ(reports.size(), scene.cloths.size());
    for (std::size_t i = 0; i < reports.size(); ++i) {
      SCOPED_TRACE(::testing::Message() << "cloth " << i << ", displaced by " << displacement);
      expectAsReference(reports[i], reference.cloths()[i], scene.cloths[i], scene.environment.gravity);
      EXPECT_EQ(reports[i].penetration, 0);
      EXPECT_EQ(reports[i].activeConstraints, 0u);
    }
  }
}

// The elastic energy uses the stiffness of forces and of constraints. Results of a solve belong to its cloth.
TEST_F(Report, HasTheSolverResultsOfEachCloth) {
  model::Scene scene = reportedScene();
  scene.cloths[1].solver.kind = model::SolverKind::acad;
  scene.cloths[1].solver.activation = 0.01f;
  scene.cloths[3].solver.kind = model::SolverKind::constraint;
  scene.cloths[3].solver.iterations = 7;
  Running running(scene);
  std::mt19937 random(12);
  running.restore(randomState(scene, random, 0.001f, 0.2f));
  const std::vector<ClothReport> reports = running.tickAndReport(inputsOf(scene));
  reference::ReferenceSimulation reference(scene);
  setState(reference, running.state());
  for (std::size_t i = 0; i < reports.size(); ++i)
    expectAsReference(reports[i], reference.cloths()[i], scene.cloths[i], scene.environment.gravity);
  std::uint32_t links = 0, structuralAndShear = 0;
  for (const model::SpringLink& link : model::springLinks(scene.cloths[3]))
    structuralAndShear += link.kind != model::SpringKind::bend ? 1 : 0;
  for (const model::SpringLink& link : model::springLinks(scene.cloths[1]))
    links += link.kind != model::SpringKind::bend ? 1 : 0;
  EXPECT_EQ(reports[3].activeConstraints, structuralAndShear);
  EXPECT_EQ(reports[3].iterations, 7u);
  EXPECT_GT(reports[3].residual, 0);
  EXPECT_GT(reports[1].activeConstraints, 0u);
  EXPECT_LT(reports[1].activeConstraints, links);
  for (const std::size_t i : {0, 2, 4}) EXPECT_EQ(reports[i].activeConstraints + reports[i].iterations, 0u);
}

// A plane through the shape is handled after it and leaves nodes deep inside the shape. With more colliders
// than a list of near colliders holds, the result is the same.
TEST_F(Report, FindsTheDeepestPenetrationIntoEveryShape) {
  const model::Shape shapes[] = {model::Sphere{0.1f},
                                 model::Capsule{.radius = 0.06f, .length = 0.2f},
                                 model::Box{model::Vec3(0.2f, 0.15f, 0.1f)},
                                 octahedron(),
                                 model::Plane{},
                                 model::Capsule{.radius = 0.1f, .length = 0.2f, .topRadius = 0.03f}};
  model::Cloth cloth = calmCloth(20, 20);
  cloth.thickness = 0;
  cloth.pins = {topRow(cloth)};
  model::Scene scene = sceneOf({cloth});
  scene.substeps = 1;
  scene.simulationRate = 720;
  std::mt19937 random(13);
  const model::Pose place{model::Vec3(0.02f, -0.2f, 0.03f), turned(-30, model::Vec3(1, 2, 3))};
  const model::Pose through{model::Vec3(0.02f, -0.2f, 0.04f), turned(95, model::Vec3::UnitX())};
  for (const model::Shape& shape : shapes)
    for (const std::size_t copies : {1, 150}) {
      SCOPED_TRACE(::testing::Message() << "shape " << shape.index() << ", " << copies << " times");
      std::vector<simulation::MovingCollider> colliders(copies, {shape, place, place, 1});
      colliders.push_back({model::Plane{}, through, through, 1});
      Running running(scene);
      running.restore(randomState(scene, random, 0.004f, 0.1f));
      const std::vector<ClothReport> reports = running.tickAndReport(inputsOf(scene, colliders));
      reference::ReferenceSimulation reference(scene);
      setState(reference, running.state());
      const double expected =
          std::max(reference.cloths()[0].penetration(shape, reference::toPose(place)),
                   reference.cloths()[0].penetration(model::Plane{}, reference::toPose(through)));
      EXPECT_GT(expected, 0.001);
      // Into the shape's frame, and less its size: some ten roundings of half a metre; a length to 1e-6.
      EXPECT_NEAR(reports[0].penetration, expected, 20 * kRounding + 2e-7);
    }
}

TEST_F(Report, FindsNoPenetrationOfClothOnACollider) {
  model::Scene scene = sceneOf({calmCloth(12, 12)});
  const model::Pose below{model::Vec3(0, -0.1f, -0.101f), model::Quaternion::Identity()};
  const simulation::TickInputs inputs = inputsOf(scene, {{model::Sphere{0.1f}, below, below, 1}});
  Running running(scene);
  for (int tick = 0; tick < 20; ++tick)
    ASSERT_EQ(running.tickAndReport(inputs)[0].penetration, 0) << "tick " << tick;
}

TEST_F(Report, HasTheSameBitsForEveryWorkgroupSizeAndChangesNothing) {
  model::Scene scene = reportedScene();
  scene.cloths[1].solver.kind = model::SolverKind::acad;
  scene.cloths[3].solver.kind = model::SolverKind::constraint;
  const model::Pose place{model::Vec3(0.2f, -0.3f, -0.35f), turned(20, model::Vec3::UnitX())};
  const simulation::TickInputs inputs = inputsOf(
      scene,
      {{model::Sphere{0.1f}, place, place, 1}, {model::Box{model::Vec3(0.1f, 0.1f, 0.1f)}, place, place, 1}});
  Running usual(scene), narrow(scene, {.rowsPerInvocation = 1, .workgroupSize = 32, .advanceKernel = {}}),
      wide(scene, {.rowsPerInvocation = 5, .workgroupSize = 256, .advanceKernel = {}}), silent(scene);
  std::mt19937 random(14);
  const NodeState start = randomState(scene, random, 0.003f, 0.5f);
  for (Running* running : {&usual, &narrow, &wide, &silent}) running->restore(start);
  for (int tick = 0; tick < 40; ++tick) {
    const std::vector<std::byte> bits = bitsOf(usual.tickAndReport(inputs));
    ASSERT_EQ(bitsOf(narrow.tickAndReport(inputs)), bits) << "tick " << tick;
    ASSERT_EQ(bitsOf(wide.tickAndReport(inputs)), bits) << "tick " << tick;
    silent.tick(inputs);
  }
  EXPECT_EQ(usual.save().bytes, silent.save().bytes);
}

}  // namespace
}  // namespace clothstream::tests
