// SPDX-License-Identifier: MIT
// The dress of the built-in figure stays on it, and outside of it, for ten minutes. Takes about 20 minutes on
// two cores of lavapipe.
#include <iostream>

#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "tests/simulation/dressed.h"

namespace clothstream::tests {
namespace {

class DressedLong : public GpuTest {};

TEST_F(DressedLong, ADressStaysOnTheFigureForTenMinutes) {
  const model::Scene scene = *messages::loadScene("dress");
  Walk walk(scene);
  for (int minute = 0; minute < 10; ++minute) walk.on(60 * scene.simulationRate, 12);
  std::cout << walk.text() << "\n";
  EXPECT_LE(walk.wear().depth, 0.002) << walk.text();
  EXPECT_LE(walk.wear().strain, 0.05) << walk.text();
  EXPECT_LE(walk.wear().excess, 0.01) << walk.text();
  EXPECT_LE(walk.wear().astray, 1e-5) << walk.text();
}

}  // namespace
}  // namespace clothstream::tests
