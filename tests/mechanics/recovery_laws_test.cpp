// SPDX-License-Identifier: MIT
// Cloth that is far too long returns to its length, and cloth whose attachments jump goes along.
// docs/mechanics.md has the figures.
#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "server/model/jump.h"
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

// Springs that are forces keep the energy of the stretch until damping has taken it.
bool bounces(const Way& way) {
  return way.solver.kind == model::SolverKind::massSpring;
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
  EXPECT_LT(recovered, bounces(GetParam()) ? 1 : 1.5 * usual + 0.02);
  expectRow({GetParam().name, figure(usual), figure(recovered)});
}

// Hung at both upper corners by an attachment each.
model::Scene hungAtCorners(const Way& way) {
  model::Scene scene = hung(way);
  model::Cloth& cloth = scene.cloths[0];
  cloth.pins.clear();
  cloth.bend.stiffness = 0.5f;
  for (const std::uint32_t column : {0u, cloth.grid.columns - 1}) {
    model::Attachment& corner = cloth.attachments.emplace_back();
    corner.name = column == 0 ? "left" : "right";
    corner.vertices = {column};
  }
  return scene;
}

// Runs two seconds of calm and then two seconds in which the attachments are `moves`, tick by tick from the
// first; the last one stays.
simulation::NodeState afterMoves(const model::Scene& scene,
                                 const std::vector<std::array<model::Pose, 2>>& moves) {
  tests::Running running(scene);
  after(running, scene, 2);
  std::array<model::Pose, 2> frames = {};
  for (std::uint32_t tick = 0; tick < 2 * scene.simulationRate; ++tick) {
    const std::array<model::Pose, 2> before = frames;
    if (!moves.empty()) frames = moves[std::min<std::size_t>(tick, moves.size() - 1)];
    simulation::TickInputs inputs = tests::inputsOf(scene);
    inputs.attachments.assign(frames.begin(), frames.end());
    inputs.carries = model::carriesOf(scene, before, inputs.attachments);
    EXPECT_TRUE(running.tick(inputs).healthy);
  }
  return running.state();
}

double largestDistance(const simulation::NodeState& state, const simulation::NodeState& expected,
                       const model::Pose& moved = {}) {
  double largest = 0;
  for (std::size_t i = 0; i < state.positions.size(); ++i)
    largest = std::max(
        largest,
        double{(state.positions[i] - moved.position - moved.orientation * expected.positions[i]).norm()});
  return largest;
}

TEST_P(RecoveryLaws, JumpsLeaveNothingBehind) {
  const model::Scene scene = hungAtCorners(GetParam());
  const simulation::NodeState calm = afterMoves(scene, {});
  const double usual = tests::strainOf(scene, calm).max;
  // Both corners jump by 5 m and turn about the vertical.
  const model::Pose away{model::Vec3(5, 0, 0), tests::turned(90, model::Vec3::UnitY())};
  const double jump = largestDistance(afterMoves(scene, {{away, away}}), calm, away);
  // One corner jumps by 3 m, out of the plane too, and is back in the next tick.
  const model::Pose lost{model::Vec3(2, 1, 2), model::Quaternion::Identity()};
  const simulation::NodeState back = afterMoves(scene, {{model::Pose(), lost}, {}});
  const double glitch = tests::strainOf(scene, back).max;
  EXPECT_LT(jump, 1e-4);
  EXPECT_LT(glitch, bounces(GetParam()) ? 1 : 1.5 * usual + 0.02);
  expectRow({GetParam().name, figure(1000 * jump), figure(usual), figure(glitch)});
}

INSTANTIATE_TEST_SUITE_P(Solvers, RecoveryLaws, testing::ValuesIn(ways()),
                         [](const auto& way) { return lettersOf(way.param.name); });

}  // namespace
}  // namespace clothstream::mechanics
