// SPDX-License-Identifier: MIT
// Built-in scenes load, and the reference simulates them as intended.
#include <cmath>

#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "server/reference/reference_simulation.h"

namespace clothstream::messages {
namespace {

class NamedScene : public testing::TestWithParam<std::string> {};

TEST_P(NamedScene, LoadsByName) {
  const Result<model::Scene> scene = loadScene(GetParam());
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(scene->name, GetParam());
  EXPECT_FALSE(scene->description.empty());
}

// Scenes without triangle meshes as colliders. The reference tests every triangle of a mesh; Walker in
// tests/encode and Dressed in tests/simulation run on the device.
std::vector<std::string> scenesWithoutSolids() {
  std::vector<std::string> names = namedScenes();
  std::erase_if(
      names, [](const std::string& name) { return name == "dress" || name == "gown" || name == "walker"; });
  return names;
}

class SimulatedScene : public testing::TestWithParam<std::string> {};

// Simulates until the ball has pushed the curtain, the sheet has fallen and the flag has unfurled.
TEST_P(SimulatedScene, StaysIntactAndOutsideColliders) {
  const model::Scene scene = *loadScene(GetParam());
  reference::ReferenceSimulation simulation(scene);
  double worstMeanStrain = 0;
  while (simulation.ticks() < scene.simulationRate * 3 / 2) {
    const reference::TickInputs inputs = reference::inputsAt(scene, simulation.ticks());
    simulation.tick(inputs);
    for (const reference::ReferenceCloth& cloth : simulation.cloths()) {
      const reference::Strain strain = cloth.strain();
      ASSERT_LT(strain.max, 1) << "tick " << simulation.ticks();  // also fails when it is not a number
      worstMeanStrain = std::max(worstMeanStrain, strain.mean);
      for (const reference::MovingCollider& collider : inputs.colliders)
        for (const reference::Vec3& position : cloth.positions())
          ASSERT_GE(reference::heightOver(collider.shape, collider.end, position), 0)
              << "tick " << simulation.ticks();
    }
  }
  // Scenes of the paper's figures stretch more: they show soft springs of 100 N/m that fall on a ball.
  EXPECT_LT(worstMeanStrain, GetParam().starts_with("figure_") ? 0.15 : 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, NamedScene, testing::ValuesIn(namedScenes()),
                         [](const auto& name) { return name.param; });
INSTANTIATE_TEST_SUITE_P(All, SimulatedScene, testing::ValuesIn(scenesWithoutSolids()),
                         [](const auto& name) { return name.param; });

TEST(NamedScenes, AreAllListed) {
  EXPECT_EQ(namedScenes(), (std::vector<std::string>{"balloon",
                                                     "curtain",
                                                     "cushion",
                                                     "dress",
                                                     "figure_07",
                                                     "figure_09",
                                                     "figure_10",
                                                     "figure_11",
                                                     "figure_12",
                                                     "figure_13",
                                                     "figure_14",
                                                     "figure_15",
                                                     "flag",
                                                     "folds",
                                                     "gown",
                                                     "obstacles",
                                                     "solver_acad",
                                                     "solver_constraint",
                                                     "solver_implicit_euler",
                                                     "solver_mass_spring",
                                                     "solver_xpbd",
                                                     "sphere_drop",
                                                     "swing",
                                                     "tablecloth",
                                                     "veil",
                                                     "walker"}));
}

TEST(NamedScenes, SphereDropComesToRestOnTheSphere) {
  const model::Scene scene = *loadScene("sphere_drop");
  reference::ReferenceSimulation simulation(scene);
  while (simulation.ticks() < 6 * scene.simulationRate) simulation.tick();
  const reference::ReferenceCloth& sheet = simulation.cloths()[0];
  const double mass = scene.cloths[0].mass;
  EXPECT_LT(std::sqrt(2 * sheet.kineticEnergy() / mass), 0.01);  // m/s, root mean square
  double highest = -1e9;
  for (const reference::Vec3& position : sheet.positions()) highest = std::max(highest, position.y());
  const model::Collider& ball = scene.colliders[0];
  EXPECT_NEAR(highest,
              ball.pose.position.y() + std::get<model::Sphere>(ball.shape).radius + scene.cloths[0].thickness,
              0.002);
}

TEST(NamedScenes, FlagStreamsInTheWindAndKeepsMoving) {
  const model::Scene scene = *loadScene("flag");
  reference::ReferenceSimulation simulation(scene);
  double leastEnergy = 1e9;
  while (simulation.ticks() < 3 * scene.simulationRate) {
    simulation.tick();
    if (simulation.ticks() > 2 * scene.simulationRate)
      leastEnergy = std::min(leastEnergy, simulation.cloths()[0].kineticEnergy());
  }
  reference::Vec3 mean = reference::Vec3::Zero();
  for (const reference::Vec3& position : simulation.cloths()[0].positions())
    mean += position / simulation.cloths()[0].nodeCount();
  EXPECT_GT(mean.x(), -0.75 + 0.3);  // downwind of its held edge
  EXPECT_GT(leastEnergy, 0.02);      // J: 0.3 m/s
}

}  // namespace
}  // namespace clothstream::messages
