// SPDX-License-Identifier: MIT
// Runs stress scenes and checks every tick.
#include "tests/simulation/stressed.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/simulation/intersections.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {

void expectNoIntersection(const StressScene& stress, int ticks) {
  SCOPED_TRACE(stress.scene.name);
  ASSERT_EQ(intersections(stress.scene, stress.start.positions), 0u);
  Running running(stress.scene);
  running.restore(stress.start);
  float deepest = 0;
  std::uint64_t crowded = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    const simulation::TickStatus status = running.tick(inputsOf(stress.scene, stress.colliders(tick)));
    ASSERT_TRUE(status.healthy) << "tick " << tick;
    ASSERT_EQ(intersections(stress.scene, running.state().positions), 0u) << "tick " << tick;
    deepest = std::max(deepest, std::ranges::max(running.depths()));
    crowded += status.crowded;
  }
  EXPECT_LT(deepest, 0.05f);
  ::testing::Test::RecordProperty(stress.scene.name + " deepest mm", static_cast<int>(1000 * deepest));
  ::testing::Test::RecordProperty(stress.scene.name + " crowded", static_cast<int>(crowded));
}

}  // namespace clothstream::tests
