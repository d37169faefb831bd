// SPDX-License-Identifier: MIT
// Work of single dispatches: a scene delays other scenes by at most one slice.
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/simulation/workgroup_work.h"
#include "tests/simulation/scenes.h"

namespace clothstream::simulation {
namespace {

using enum model::SolverKind;

constexpr std::uint64_t kSlice = 1 << 19;

model::Scene manyCloths(std::size_t count, std::uint32_t size, const model::Solver& solver) {
  std::vector<model::Cloth> cloths;
  for (std::size_t i = 0; i < count; ++i) {
    cloths.push_back(tests::calmCloth(size, size));
    cloths.back().name = std::to_string(i);
    cloths.back().pins = {tests::topRow(cloths.back())};
    cloths.back().solver = solver;
  }
  return tests::sceneOf(std::move(cloths));
}

std::vector<model::Solver> solvers(std::uint32_t iterations) {
  std::vector<model::Solver> all;
  for (const model::SolverKind kind : {constraint, acad, implicitEuler, xpbd}) {
    all.emplace_back();
    all.back().kind = kind;
    all.back().iterations = iterations;
    all.back().tolerance = 0;
  }
  all.push_back(all.front());
  all.back().path = model::ConstraintPath::assembled;
  return all;
}

std::vector<MovingCollider> boxes(std::size_t count) {
  std::vector<MovingCollider> all(count);
  for (MovingCollider& collider : all) {
    collider.shape = model::Box{.size = model::Vec3::Constant(0.1f)};
    collider.start.position = {0, -0.3f, 0.05f};
    collider.end.position = {0, -0.3f, 0.04f};
  }
  return all;
}

class DispatchWorkTest : public tests::GpuTest {
 protected:
  // Work of the largest dispatch of a tick.
  static std::uint64_t largestDispatch(const model::Scene& scene, const TickInputs& inputs) {
    ClothSimulation simulation(tests::device(), scene);
    vulkan::Recorder recorder(tests::device());
    recorder.sliceAfter(kSlice);
    recorder.begin();
    simulation.recordTick(recorder, inputs);
    return recorder.largestDispatch();
  }

  static std::uint64_t hashOf(const model::Scene& scene, const TickInputs& inputs, std::uint64_t slice,
                              std::uint32_t& slices) {
    ClothSimulation simulation(tests::device(), scene);
    vulkan::Recorder recorder(tests::device());
    recorder.sliceAfter(slice);
    for (int tick = 0; tick < 2; ++tick) {
      recorder.begin();
      simulation.recordTick(recorder, inputs);
      tests::submitAndWait(tests::device(), recorder);
    }
    slices = recorder.sliceCount();
    EXPECT_TRUE(simulation.status().healthy);
    return simulation.status().stateHash;
  }

  static void expectSameBitsInSlices(const model::Scene& scene, const TickInputs& inputs) {
    std::uint32_t whole = 0, divided = 0;
    const std::uint64_t expected = hashOf(scene, inputs, ~std::uint64_t{0}, whole);
    EXPECT_EQ(hashOf(scene, inputs, 1, divided), expected);
    EXPECT_EQ(whole, 1u);
    EXPECT_GT(divided, scene.substeps);
  }
};

TEST_F(DispatchWorkTest, ManySmallSystemsAreDivided) {
  for (const model::Solver& solver : solvers(50)) {
    const model::Scene scene = manyCloths(256, 32, solver);
    // At least one workgroup for each processor, as long as one workgroup alone may take.
    const std::uint64_t most = std::max(kSlice, std::uint64_t{nodesPerDispatch(tests::device())} *
                                                    tests::device().limits().parallelWorkgroups);
    EXPECT_LE(largestDispatch(scene, tests::inputsOf(scene)), most) << static_cast<int>(solver.kind);
  }
}

TEST_F(DispatchWorkTest, LongXpbdSweepsOfAWholeClothAreDivided) {
  model::Solver solver;
  solver.kind = xpbd;
  solver.iterations = 10'000;
  const model::Scene scene = manyCloths(1, 32, solver);
  EXPECT_LE(largestDispatch(scene, tests::inputsOf(scene)), nodesPerDispatch(tests::device()));
}

TEST_F(DispatchWorkTest, CollisionsWithManyCollidersAreDivided) {
  for (const model::SolverKind kind : {massSpring, constraint, xpbd}) {
    model::Solver solver;
    solver.kind = kind;
    const model::Scene scene = manyCloths(4, 128, solver);
    const std::uint64_t most = kSlice * tests::device().limits().parallelWorkgroups;
    EXPECT_LE(largestDispatch(scene, tests::inputsOf(scene, boxes(1000))), most) << static_cast<int>(kind);
  }
}

TEST_F(DispatchWorkTest, DividedDispatchesGiveTheSameBits) {
  for (const model::Solver& solver : solvers(12)) {
    const model::Scene scene = manyCloths(24, 24, solver);
    expectSameBitsInSlices(scene, tests::inputsOf(scene, boxes(2)));
  }
  const model::Scene scene = manyCloths(4, 24, {});
  expectSameBitsInSlices(scene, tests::inputsOf(scene, boxes(200)));
}

// Pairs of cloth depend on the state. No dispatch may be long, whatever it finds.
TEST_F(DispatchWorkTest, HeapsAreSearchedInBoundedDispatches) {
  model::Scene scene = manyCloths(64, 12, {});
  for (model::Cloth& cloth : scene.cloths)
    cloth.selfCollision = model::SelfCollision{.radius = 0.01f, .friction = 0, .nothingPasses = true};
  constexpr std::uint64_t kMost = 4 * kSlice;
  ClothSimulation simulation(tests::device(), scene);
  vulkan::Recorder recorder(tests::device());
  recorder.sliceAfter(1 << 30, kMost);
  recorder.begin();
  simulation.recordTick(recorder, tests::inputsOf(scene));
  EXPECT_LE(recorder.mostOfDispatch(), kMost);
  recorder.finish();
  EXPECT_GT(recorder.sliceCount(), 2 * scene.substeps);
}

}  // namespace
}  // namespace clothstream::simulation
