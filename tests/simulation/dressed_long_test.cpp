// SPDX-License-Identifier: MIT
// Clothes of the built-in figures stay on them, and outside of them, for ten minutes. Takes about 8 minutes
// for the dress and an hour for the gown on two cores of lavapipe.
#include <iostream>
#include <string>

#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "tests/simulation/dressed.h"

namespace clothstream::tests {
namespace {

class TenMinutesOfWalking : public GpuTest, public testing::WithParamInterface<std::string> {};
INSTANTIATE_TEST_SUITE_P(Dressed, TenMinutesOfWalking, testing::Values("dress", "gown"),
                         [](const auto& name) { return name.param; });

TEST_P(TenMinutesOfWalking, KeepTheClothesOnTheFigure) {
  const model::Scene scene = *messages::loadScene(GetParam());
  Walk walk(scene);
  for (int minute = 0; minute < 10; ++minute) walk.on(60 * scene.simulationRate, 12);
  std::cout << GetParam() << ": " << walk.text() << "\n";
  EXPECT_LE(walk.wear().depth, 0.002) << walk.text();
  EXPECT_LE(walk.wear().strain, 0.05) << walk.text();
  EXPECT_LE(walk.wear().excess, 0.01) << walk.text();
  EXPECT_LE(walk.wear().astray, 1e-5) << walk.text();
  EXPECT_EQ(walk.wear().intersections, 0u) << walk.text();
}

}  // namespace
}  // namespace clothstream::tests
