// SPDX-License-Identifier: MIT
// The dress of the built-in figure stays on it, and outside of it, for two steps.
#include "tests/simulation/dressed.h"

#include <gtest/gtest.h>

#include "server/messages/scene_file.h"

namespace clothstream::tests {
namespace {

class Dressed : public GpuTest {};

// Two steps take 1.2 s. Meshes act after the limits, so a body may push a node beyond its distance.
TEST_F(Dressed, ADressStaysOnTheFigureForTwoSteps) {
  const model::Scene scene = *messages::loadScene("dress");
  Walk walk(scene);
  for (int quarter = 0; quarter < 4; ++quarter) {
    walk.on(22, 11);
    // The bodice is made 12 mm from the body, whose triangles are inside of its curves by less than 2 mm.
    EXPECT_GT(walk.nearestExact(), 0.008);
  }
  EXPECT_LE(walk.wear().depth, 0.002) << walk.text();
  EXPECT_LE(walk.wear().strain, 0.05) << walk.text();
  EXPECT_LE(walk.wear().excess, 0.01) << walk.text();
  // A node gets the velocity to its place once a tick; the rounding of a few substeps at 1.5 m is 1e-6 m.
  EXPECT_LE(walk.wear().astray, 1e-5) << walk.text();
}

}  // namespace
}  // namespace clothstream::tests
