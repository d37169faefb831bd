// SPDX-License-Identifier: MIT
// The settings of kernels for GPUs give the same bits as those for CPUs in every built-in scene.
#include <string>

#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "tests/kernel_survey/settings_pair.h"

namespace clothstream::kernel_survey {
namespace {

class BuiltInKernelSettings : public ::testing::TestWithParam<std::string> {};

TEST_P(BuiltInKernelSettings, GiveTheSameBits) {
  const messages::Result<model::Scene> scene = messages::loadScene(GetParam());
  ASSERT_TRUE(scene) << scene.error().text;
  SettingsPair pair(*scene);
  for (std::uint64_t tick = 0; tick < 3; ++tick)
    pair.expectSameTick(simulation::inputsAt(*scene, tick), static_cast<int>(tick));
}

INSTANTIATE_TEST_SUITE_P(Scenes, BuiltInKernelSettings, ::testing::ValuesIn(messages::namedScenes()),
                         [](const auto& scene) { return scene.param; });

}  // namespace
}  // namespace clothstream::kernel_survey
