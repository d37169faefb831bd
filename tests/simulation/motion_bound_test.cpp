// SPDX-License-Identifier: MIT
// Cloth that nothing passes through.
#include "server/reference/motion_bound.h"

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/simulation/motion_bound/motion_bound_stage.h"
#include "tests/simulation/intersections.h"
#include "tests/simulation/scenes.h"
#include "tests/simulation/stressed.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;
using simulation::TickStatus;

class MotionBound : public GpuTest {};

model::Cloth bounded(model::Cloth cloth) {
  cloth.selfCollision = model::SelfCollision{.radius = 0.01f, .friction = 0.3f, .nothingPasses = true};
  return cloth;
}

// Two sheets in layers of 1 to 5 mm, whose edges are not parallel, and the ends of random motions of up to
// `speed` times a substep.
struct Motion {
  model::Scene scene;
  NodeState start, end;
};

Motion layeredMotion(unsigned seed, float speed) {
  model::Cloth upper = bounded(calmCloth(9, 8)), lower = bounded(calmCloth(10, 9));
  upper.pins = {topRow(upper)};
  lower.grid.pose = {model::Vec3(0.003f, -0.004f, -0.003f), turned(25, model::Vec3::UnitZ())};
  model::Scene scene = sceneOf({upper, lower});
  Motion motion{scene, simulation::restState(scene.cloths), {}};
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return model::Vec3(unit(random), unit(random), unit(random)); };
  for (model::Vec3& p : motion.start.positions) p += 0.001f * vector();
  motion.end = motion.start;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    if (masses[i] == 0) continue;
    motion.end.velocities[i] = speed * vector();
    motion.end.positions[i] += static_cast<float>(scene.substepSeconds()) * motion.end.velocities[i];
  }
  return motion;
}

// Runs only the stage, on a given motion, twice: the second time everything that it keeps is that of the
// first.
class Bound {
 public:
  explicit Bound(const Motion& motion, std::uint32_t workgroupSize = 64)
      : nodes_(motion.scene.nodeCount()),
        stage_(device(), motion.scene,
               {.cloths = none_,
                .colliders = none_,
                .nearColliders = none_,
                .contactImpulses = none_,
                .stretches = none_,
                .positions = {&positions_[0], &positions_[1]},
                .velocities = {&velocities_[0], &velocities_[1]}},
               workgroupSize) {
    const simulation::TickInputs inputs{motion.scene.environment, {}};
    const simulation::Tick tick{
        .inputs = inputs, .cloths = {}, .substepSeconds = motion.scene.substepSeconds()};
    for (int run = 0; run < 2; ++run) {
      recorder_.begin();
      stage_.uploadTables(recorder_);
      const std::vector<float> masses = simulation::inverseMasses(motion.scene.cloths);
      std::size_t offset = 0;
      const auto load = [&](const std::vector<model::Vec3>& vectors, const vulkan::Buffer& to, bool weighed) {
        const auto texels = upload_.mapped<shared::vec4>().subspan(offset, nodes_);
        for (std::size_t i = 0; i < nodes_; ++i)
          texels[i] = {vectors[i].x(), vectors[i].y(), vectors[i].z(), weighed ? masses[i] : 0};
        recorder_.copy(upload_, to, nodes_ * sizeof(shared::vec4), offset * sizeof(shared::vec4));
        offset += nodes_;
      };
      load(motion.start.positions, positions_[0], true);
      load(motion.end.positions, positions_[1], true);
      load(motion.end.velocities, velocities_[1], false);
      stage_.recordInputs(recorder_, tick);
      stage_.recordSubstep(recorder_, {.tick = tick});
      recorder_.barrier();
      stage_.recordReport(recorder_, tick);
      recorder_.copy(positions_[1], readback_, nodes_ * sizeof(shared::vec4));
      recorder_.copy(velocities_[1], readback_, nodes_ * sizeof(shared::vec4), 0,
                     nodes_ * sizeof(shared::vec4));
      submitAndWait(device(), recorder_);
    }
  }

  NodeState state() const {
    NodeState state;
    const auto texels = readback_.mapped<const shared::vec4>();
    for (std::size_t i = 0; i < nodes_; ++i) {
      state.positions.emplace_back(texels[i].x, texels[i].y, texels[i].z);
      state.velocities.emplace_back(texels[nodes_ + i].x, texels[nodes_ + i].y, texels[nodes_ + i].z);
    }
    return state;
  }
  simulation::MotionBoundStage::Report report() const { return stage_.report(0); }

 private:
  vulkan::Buffer buffer(vulkan::BufferPurpose purpose, std::size_t copies = 1) const {
    return vulkan::Buffer(device(), purpose, copies * nodes_ * sizeof(shared::vec4));
  }

  std::size_t nodes_;
  vulkan::Buffer none_ = buffer(vulkan::BufferPurpose::texels);
  std::array<vulkan::Buffer, 2> positions_{buffer(vulkan::BufferPurpose::texels),
                                           buffer(vulkan::BufferPurpose::texels)};
  std::array<vulkan::Buffer, 2> velocities_{buffer(vulkan::BufferPurpose::texels),
                                            buffer(vulkan::BufferPurpose::texels)};
  vulkan::Buffer upload_ = buffer(vulkan::BufferPurpose::upload, 3);
  vulkan::Buffer readback_ = buffer(vulkan::BufferPurpose::readback, 2);
  vulkan::Recorder recorder_{device()};
  simulation::MotionBoundStage stage_;
};

// Rounding of a position (2^-24 of 0.3 m), over a distance of at least half a floor (0.1 mm), turns a
// direction by 3e-4. That moves the end of a motion of 7 mm by 2e-6 m; separate pairs add up.
constexpr double kTolerance = 1e-5;

TEST_F(MotionBound, EndsMotionsWhereTheReferenceEndsThem) {
  for (const float speed : {0.2f, 1.0f, 3.0f}) {
    const Motion motion = layeredMotion(3, speed);
    const Bound bound(motion);
    ASSERT_EQ(bound.report().overflows, 0u);
    const NodeState state = bound.state();
    std::vector<reference::Vec3> start, positions, velocities;
    std::vector<double> masses;
    for (const model::Vec3& p : motion.start.positions) start.push_back(p.cast<double>());
    for (const model::Vec3& p : motion.end.positions) positions.push_back(p.cast<double>());
    for (const model::Vec3& v : motion.end.velocities) velocities.push_back(v.cast<double>());
    for (const float mass : simulation::inverseMasses(motion.scene.cloths)) masses.push_back(double{mass});
    reference::MotionBound(motion.scene)
        .apply(start, positions, velocities, masses, motion.scene.substepSeconds());
    double largest = 0, moved = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      largest = std::max(largest, (state.positions[i].cast<double>() - positions[i]).norm());
      moved = std::max(moved, (motion.end.positions[i].cast<double>() - positions[i]).norm());
      EXPECT_NEAR((state.velocities[i].cast<double>() - velocities[i]).norm(), 0, 720 * kTolerance);
    }
    EXPECT_LT(largest, kTolerance) << speed << " m/s";
    EXPECT_GT(moved, 20 * kTolerance) << speed << " m/s";
  }
}

TEST_F(MotionBound, WildMotionsLeaveNoIntersection) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Motion motion = layeredMotion(seed, 5);
    ASSERT_EQ(intersections(motion.scene, motion.start.positions), 0u);
    EXPECT_GT(intersections(motion.scene, motion.end.positions), 20u);
    const Bound bound(motion);
    EXPECT_EQ(intersections(motion.scene, bound.state().positions), 0u) << "seed " << seed;
    EXPECT_GT(bound.report().shortened, 10u);
    EXPECT_EQ(bound.report().overflows, 0u);
  }
}

TEST_F(MotionBound, GivesTheSameBitsForEveryWorkgroup) {
  const Motion motion = layeredMotion(5, 3);
  const NodeState usual = Bound(motion).state();
  for (const std::uint32_t size : {8u, 32u, 128u}) {
    const NodeState state = Bound(motion, size).state();
    EXPECT_TRUE(state.positions == usual.positions) << size << " invocations";
    EXPECT_TRUE(state.velocities == usual.velocities) << size << " invocations";
  }
}

// Two sheets and a disc fly through each other, if nothing hinders them.
std::uint64_t hashOfWildMotion(bool nothingPasses, std::uint32_t workgroupSize) {
  const Motion motion = layeredMotion(7, 5);
  model::Scene scene = motion.scene;
  scene.cloths.push_back(bounded(discCloth(4)));
  scene.cloths.back().solver.kind = model::SolverKind::xpbd;
  for (model::Cloth& cloth : scene.cloths) cloth.selfCollision->nothingPasses = nothingPasses;
  NodeState start = simulation::restState(scene.cloths);
  std::ranges::copy(motion.start.positions, start.positions.begin());
  std::ranges::copy(motion.end.velocities, start.velocities.begin());
  for (std::size_t i = motion.start.positions.size(); i < start.positions.size(); ++i) {
    start.positions[i] += model::Vec3(0.05f, 0.1f, 0.01f);
    start.velocities[i] = model::Vec3(0, -3, 0);
  }
  EXPECT_EQ(intersections(scene, start.positions), 0u);
  Running running(scene, {.workgroupSize = workgroupSize});
  running.restore(start);
  TickStatus status;
  for (int tick = 0; tick < 8; ++tick) status = running.tick(inputsOf(scene));
  EXPECT_EQ(intersections(scene, running.state().positions) == 0, nothingPasses);
  return status.stateHash;
}

TEST_F(MotionBound, ReachesTheHashOfEveryOtherDevice) {
  constexpr std::uint64_t kHash = 13215643316081303100u;
  EXPECT_EQ(hashOfWildMotion(true, 0), kHash);
  EXPECT_EQ(hashOfWildMotion(true, 32), kHash);
  EXPECT_NE(hashOfWildMotion(false, 0), kHash);
}

// `count` sheets in one place, each of which moves down.
Motion heapOfSheets(std::size_t count) {
  std::vector<model::Cloth> sheets;
  for (std::size_t i = 0; i < count; ++i) {
    sheets.push_back(bounded(calmCloth(12, 12)));
    sheets.back().name = std::to_string(i);
  }
  model::Scene scene = sceneOf(std::move(sheets));
  Motion motion{scene, simulation::restState(scene.cloths), {}};
  motion.end = motion.start;
  for (std::size_t i = 0; i < motion.end.positions.size(); ++i) {
    motion.end.velocities[i] = model::Vec3(0, -1, 0);
    motion.end.positions[i].y() -= 0.001f;
  }
  return motion;
}

// More pairs than the lists hold: the search ends early, nothing is computed for the pairs, and no node
// moves. The result does not depend on the order in which invocations run.
TEST_F(MotionBound, AHeapThatIsTooDenseStandsStill) {
  const Motion motion = heapOfSheets(48);
  const Bound bound(motion), narrow(motion, 8);
  EXPECT_EQ(bound.report().overflows, 1u);
  const NodeState state = bound.state();
  EXPECT_EQ(simulation::pack(state, 1).bytes, simulation::pack(narrow.state(), 1).bytes);
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    ASSERT_EQ(state.positions[i], motion.start.positions[i]);
    ASSERT_EQ(state.velocities[i], model::Vec3(0, 0, 0));
  }
}

// Triangles whose boxes the search cannot tell apart, because they moved far from their places at rest: few
// pairs, but every search would visit most of the tree.
TEST_F(MotionBound, ASearchOfTooManyBoxesEndsToo) {
  Motion motion = heapOfSheets(40);
  // Node i of the sheets gets the place of another one, so that triangles become long and cross everything.
  std::mt19937 random(4);
  for (NodeState* state : {&motion.start, &motion.end})
    for (model::Vec3& position : state->positions) position.x() += 1;
  std::shuffle(motion.start.positions.begin(), motion.start.positions.end(), random);
  motion.end.positions = motion.start.positions;
  const Bound bound(motion), narrow(motion, 8);
  EXPECT_EQ(bound.report().overflows, 1u);
  EXPECT_EQ(simulation::pack(bound.state(), 1).bytes, simulation::pack(narrow.state(), 1).bytes);
}

TEST_F(MotionBound, CalmClothKeepsItsMotion) {
  model::Scene scene = sceneOf({calmCloth(20, 20)});
  scene.cloths[0].pins = {topRow(scene.cloths[0])};
  model::Scene with = scene;
  scene.cloths[0].selfCollision = model::SelfCollision{.radius = 0.01f};
  with.cloths[0] = bounded(scene.cloths[0]);
  Running one(scene), other(with);
  for (int tick = 0; tick < 24; ++tick) {
    const TickStatus status = one.tick(inputsOf(scene));
    ASSERT_EQ(other.tick(inputsOf(with)).stateHash, status.stateHash) << "tick " << tick;
  }
}

TEST_F(MotionBound, MovesNodesAsTheReferenceInATick) {
  model::Scene scene = sceneOf({bounded(calmCloth(9, 8)), bounded(calmCloth(8, 9))});
  scene.substeps = 1;
  scene.simulationRate = 720;
  scene.cloths[1].grid.pose.position = model::Vec3(0.003f, -0.004f, -0.012f);
  std::mt19937 random(8);
  const NodeState start = randomState(scene, random, 0.002f, 3);
  Running running(scene);
  running.restore(start);
  running.tick(inputsOf(scene));
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputsOf(scene)));
  EXPECT_LT(largestDistance(running.state(), reference), kTolerance);
}

// The start of two of the stress scenes; nothing_passes_test.cpp has all five.
TEST_F(MotionBound, AHandAndABoxAt5MetresPerSecondLeaveNoIntersection) {
  const std::vector<StressScene> scenes = stressScenes(true);
  expectNoIntersection(scenes.front(), 14);
  expectNoIntersection(scenes.back(), 36);
}

}  // namespace
}  // namespace clothstream::tests
