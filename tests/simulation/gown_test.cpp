// SPDX-License-Identifier: MIT
// The gown and the cape of the built-in figure stay on it, outside of it, and apart, for five seconds. Takes
// about five minutes on two cores of lavapipe.
#include <iostream>

#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "tests/simulation/dressed.h"

namespace clothstream::tests {
namespace {

class Gown : public GpuTest {};

// Two steps take 86.4 ticks, so that each fifth tick is at another phase of them.
TEST_F(Gown, AGownAndACapeStayOnTheFigureAndApart) {
  const model::Scene scene = *messages::loadScene("gown");
  Walk walk(scene);
  for (int eighth = 0; eighth < 8; ++eighth) {
    walk.on(5 * scene.simulationRate / 8, 5);
    // The bodice is made 12 mm from the body, the cape's shoulders 34 mm, where arms come nearer to them.
    EXPECT_GT(walk.nearestExact(), 0.008);
  }
  std::cout << walk.text() << "\n";
  EXPECT_LE(walk.wear().depth, 0.002) << walk.text();
  EXPECT_LE(walk.wear().strain, 0.05) << walk.text();
  EXPECT_LE(walk.wear().excess, 0.01) << walk.text();
  EXPECT_LE(walk.wear().astray, 1e-5) << walk.text();
  EXPECT_EQ(walk.wear().crossings, 0u) << walk.text();
}

}  // namespace
}  // namespace clothstream::tests
