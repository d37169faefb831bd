// SPDX-License-Identifier: MIT
// Cloth that is far too long returns to its length. docs/mechanics.md has the figures.
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/mechanics/rows.h"
#include "tests/mechanics/ways.h"
#include "tests/simulation/scenes.h"

namespace clothstream::mechanics {
namespace {

constexpr double kRecoverySeconds = 2;

// Hung by its upper edge.
model::Scene hung(const Way& way) {
  model::Cloth cloth = clothOf(way);
  cloth.grid.pose = {};
  cloth.damping = 1;
  cloth.pins = {tests::topRow(cloth)};
  return sceneOf(cloth);
}

// Six times as long, and up to 2 mm off its plane: in the plane itself, every fold would be at rest.
simulation::NodeState stretched(const model::Scene& scene) {
  simulation::NodeState state = simulation::restState(scene.cloths);
  const std::vector<std::uint8_t> pinned = model::pinnedNodes(scene.cloths[0]);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> off(-0.002f, 0.002f);
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    if (pinned[i] != 0) continue;
    state.positions[i].y() *= 6;
    state.positions[i].z() = off(random);
  }
  return state;
}

// Largest strain after the time for recovery.
double strainFrom(const simulation::NodeState& start, const model::Scene& scene) {
  tests::Running running(scene);
  running.restore(start);
  return tests::strainOf(scene, after(running, scene, kRecoverySeconds)).max;
}

class RecoveryLaws : public tests::GpuTest, public testing::WithParamInterface<Way> {};

TEST_P(RecoveryLaws, ClothThatIsSixTimesAsLongRecovers) {
  const model::Scene scene = hung(GetParam());
  const double usual = strainFrom(simulation::restState(scene.cloths), scene);
  const double recovered = strainFrom(stretched(scene), scene);
  // Springs that are forces keep the energy of the stretch until damping has taken it.
  const bool bounces = GetParam().solver.kind == model::SolverKind::massSpring;
  EXPECT_LT(recovered, bounces ? 1 : 1.5 * usual + 0.005);
  expectRow({GetParam().name, figure(usual), figure(recovered)});
}

INSTANTIATE_TEST_SUITE_P(Solvers, RecoveryLaws, testing::ValuesIn(ways()), nameOfWay);

}  // namespace
}  // namespace clothstream::mechanics
