// SPDX-License-Identifier: MIT
// Stress scenes of cloth that nothing passes through, to their ends.
#include <algorithm>

#include <gtest/gtest.h>

#include "tests/simulation/intersections.h"
#include "tests/simulation/scenes.h"
#include "tests/simulation/stressed.h"

namespace clothstream::tests {
namespace {

class NothingPasses : public GpuTest {
 protected:
  void expectNone(std::size_t number) {
    const StressScene stress = stressScenes(true)[number];
    expectNoIntersection(stress, stress.ticks);
  }
};

TEST_F(NothingPasses, AFastHandLeavesNoIntersection) {
  expectNone(0);
}
TEST_F(NothingPasses, PressedFoldsLeaveNoIntersection) {
  expectNone(1);
}
TEST_F(NothingPasses, ACrumpledPileLeavesNoIntersection) {
  expectNone(2);
}
TEST_F(NothingPasses, ThrownSheetsLeaveNoIntersection) {
  expectNone(3);
}
TEST_F(NothingPasses, AStruckHeapLeavesNoIntersection) {
  expectNone(4);
}

TEST_F(NothingPasses, BallsAloneLetClothPassInTheSameScenes) {
  for (const StressScene& stress : stressScenes(false)) {
    Running running(stress.scene);
    running.restore(stress.start);
    std::size_t worst = 0;
    for (int tick = 0; tick < stress.ticks; ++tick) {
      running.tick(inputsOf(stress.scene, stress.colliders(tick)));
      worst = std::max(worst, intersections(stress.scene, running.state().positions));
    }
    EXPECT_GT(worst, 0u) << stress.scene.name;
    RecordProperty(stress.scene.name, static_cast<int>(worst));
  }
}

}  // namespace
}  // namespace clothstream::tests
