// SPDX-License-Identifier: MIT
// The settings of kernels for GPUs give the same bits as those for CPUs, on the device of the tests.
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/vulkan/device.h"
#include "tests/kernel_survey/settings_pair.h"
#include "tests/simulation/scenes.h"

namespace clothstream::kernel_survey {
namespace {

using enum model::SolverKind;

class KernelSettings : public tests::GpuTest {};

TEST_F(KernelSettings, FollowTheDeviceUnlessTheyAreGiven) {
  const vulkan::Device automatic{vulkan::DeviceOptions{}}, cpu({.kernels = vulkan::KernelSettings::cpu}),
      gpu({.kernels = vulkan::KernelSettings::gpu});
  EXPECT_EQ(automatic.hasGpuKernels(), !automatic.isSoftware());
  EXPECT_FALSE(cpu.hasGpuKernels());
  EXPECT_TRUE(gpu.hasGpuKernels());
}

class SolverSettings : public tests::GpuTest, public ::testing::WithParamInterface<model::SolverKind> {};

// Cloths that one workgroup works on with both settings, and that several work on with those for GPUs.
TEST_P(SolverSettings, GiveTheSameBits) {
  model::Scene scene;
  // Spring forces need short steps.
  scene.substeps = GetParam() == massSpring ? 8 : 2;
  for (const auto& [rows, columns] : {std::pair{11u, 17u}, {41u, 37u}})
    for (const bool mesh : {false, true}) {
      model::Cloth cloth = tests::calmCloth(rows, columns);
      cloth.pins = {tests::topRow(cloth)};
      cloth.friction = 0.4f;
      cloth.drag = 0.6f;
      cloth.lift = 0.4f;
      cloth.solver.kind = GetParam();
      cloth.solver.iterations = GetParam() == xpbd ? 3 : 20;
      scene.cloths.push_back(mesh ? model::asMesh(cloth) : cloth);
    }
  SettingsPair pair(scene);
  for (int tick = 0; tick < 6; ++tick) pair.expectSameTick(tests::passingBall(scene, tick), tick);
}

// The scenes of built_in_settings_test.cpp have the other solvers.
INSTANTIATE_TEST_SUITE_P(Solvers, SolverSettings, ::testing::Values(massSpring, xpbd, implicitEuler));

TEST_F(KernelSettings, GiveTheSameBitsOfClothThatNothingPassesThrough) {
  model::Cloth grid = tests::calmCloth(13, 18), mesh = model::asMesh(tests::calmCloth(12, 14));
  grid.selfCollision = mesh.selfCollision = model::SelfCollision{.radius = 0.01f, .nothingPasses = true};
  grid.grid.pose.position.z() = 0.03f;
  SettingsPair pair(tests::sceneOf({grid, mesh}));
  for (int tick = 0; tick < 8; ++tick) pair.expectSameTick(tests::passingBall(pair.scene(), tick), tick);
}

TEST_F(KernelSettings, GiveTheSameBitsAndNormalsOfUndampedSprings) {
  model::Cloth cloth = tests::calmCloth(33, 18);
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0;
  cloth.pins = {tests::topRow(cloth)};
  model::Cloth corrected = cloth;
  corrected.solver.kind = xpbd;
  SettingsPair pair(tests::sceneOf({cloth, corrected}));
  for (int tick = 0; tick < 4; ++tick) pair.expectSameTick(tests::passingBall(pair.scene(), tick), tick);
  pair.expectSameNormals();
}

}  // namespace
}  // namespace clothstream::kernel_survey
