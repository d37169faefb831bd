// SPDX-License-Identifier: MIT
// Meshes over several ticks: the motion of a grid that is given as a mesh, the same bits in every run, and
// changes while it runs.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

class Meshes : public GpuTest {};

// Both hang from their top row and drop into their springs. Around a taut cloth the difference x of the two
// obeys M x'' + C x' + K x = f with K >= 0. No mode of it grows beyond that of a free mass: over all nodes,
// rms(x) <= |f| / m T^2 / 2. The differing force f has a term for each of a node's twelve springs: the
// stiffness times three roundings. These are the rounding of the rest length (four roundings of positions,
// model/mesh.h), the rounding of the ends' difference in both cloths (twice two), and some ten roundings of
// the length. The term of the dashpots is far smaller.
TEST_F(Meshes, MoveAsTheEquivalentGrid) {
  model::Cloth cloth = calmCloth(24, 20);
  cloth.structural.stiffness = 50;
  cloth.shear.stiffness = cloth.bend.stiffness = 25;
  cloth.pins = {topRow(cloth)};
  const model::Scene grid = sceneOf({cloth}), mesh = sceneOf({model::asMesh(cloth)});
  Running ofGrid(grid), ofMesh(mesh);
  const int ticks = 36;
  for (int tick = 0; tick < ticks; ++tick) {
    ofGrid.tick(inputsOf(grid));
    ofMesh.tick(inputsOf(mesh));
  }
  const double extent = 0.7, length = 0.04, rounding = std::ldexp(1.0, -24);
  const double force = 4 * (50 + 25 + 25) * rounding * (4 * extent + 4 * extent + 10 * length);
  const double seconds = ticks / 72.0, bound = force / 0.01 * seconds * seconds / 2;
  const simulation::NodeState a = ofGrid.state(), b = ofMesh.state(),
                              start = simulation::restState(grid.cloths);
  double difference = 0, motion = 0;
  for (std::size_t i = 0; i < a.positions.size(); ++i) {
    difference += (a.positions[i] - b.positions[i]).squaredNorm();
    motion += (a.positions[i] - start.positions[i]).squaredNorm();
  }
  const auto nodes = static_cast<double>(a.positions.size());
  EXPECT_LT(std::sqrt(difference / nodes), bound);
  EXPECT_GT(std::sqrt(motion / nodes), 10 * bound);  // the motion is far larger, so the comparison can fail
}

model::Scene discs() {
  model::Cloth low = discCloth(14), high = discCloth(9);
  low.drag = high.drag = 0.5f;
  high.lift = 0.2f;
  low.pinnedVertices = {0};
  model::Scene scene = sceneOf({low, calmCloth(8, 9), high});
  scene.environment.wind = model::Vec3(2, 1, -1);
  return scene;
}

simulation::TickInputs discInputs(const model::Scene& scene) {
  return inputsOf(
      scene,
      {{model::Sphere{0.15f}, {model::Vec3(0.1f, -0.2f, 0)}, {model::Vec3(0.1f, -0.19f, 0.01f)}, 0.5f}});
}

TEST_F(Meshes, HaveTheSameBitsForEveryWorkgroupSize) {
  const model::Scene scene = discs();
  std::vector<std::uint64_t> hashes;
  for (const std::uint32_t workgroup : {64u, 8u, 32u, 128u}) {
    Running running(scene, {.rowsPerInvocation = 0, .workgroupSize = workgroup});
    simulation::TickStatus status{};
    for (int tick = 0; tick < 30; ++tick) status = running.tick(discInputs(scene));
    EXPECT_TRUE(status.healthy);
    hashes.push_back(status.stateHash);
  }
  EXPECT_EQ(std::vector<std::uint64_t>(hashes.size(), hashes.front()), hashes);
}

TEST_F(Meshes, KeepPinnedNodesInPlace) {
  const model::Scene scene = discs();
  Running running(scene);
  for (int tick = 0; tick < 20; ++tick) running.tick(discInputs(scene));
  const simulation::NodeState start = simulation::restState(scene.cloths), state = running.state();
  EXPECT_EQ(state.positions[0], start.positions[0]);
  EXPECT_GT((state.positions[5] - start.positions[5]).norm(), 0.001f);
}

TEST_F(Meshes, TakeParametersWhileRunning) {
  model::Scene scene = sceneOf({discCloth(6)});
  Running soft(scene), stiff(scene);
  scene.cloths[0].structural.stiffness = 400;
  stiff.setCloths(scene.cloths);
  std::mt19937 random(4);
  const simulation::NodeState start = randomState(scene, random, 0.003f, 0);
  soft.restore(start);
  stiff.restore(start);
  EXPECT_NE(soft.tick(inputsOf(scene)).stateHash, stiff.tick(inputsOf(scene)).stateHash);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputsOf(scene)));
  EXPECT_LT(largestDistance(stiff.state(), reference), 1e-5);
  EXPECT_GT(largestDistance(soft.state(), reference), 1e-4);
}

}  // namespace
}  // namespace clothstream::tests
