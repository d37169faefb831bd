// SPDX-License-Identifier: MIT
// Limits of corrections after changes of solvers.
#include "server/scene/solver_easing.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using model::SolverKind;

// Two cloths, 40 ticks/s with 12 substeps. Easing lasts 20 ticks.
model::Scene twoCloths() {
  model::Scene scene = tests::smallScene();
  scene.cloths.push_back(scene.cloths.front());
  return scene;
}

TEST(SolverEasing, LimitsOnlyClothsWhoseSolverChanges) {
  const model::Scene before = twoCloths();
  model::Scene changed = before;
  changed.cloths[1].solver.kind = SolverKind::constraint;
  changed.cloths[0].drag = 2;
  SolverEasing easing(2);
  easing.change(before, changed, 100);
  EXPECT_FALSE(changed.cloths[0].solver.correctionFraction);
  ASSERT_TRUE(changed.cloths[1].solver.correctionFraction);
  EXPECT_FLOAT_EQ(*changed.cloths[1].solver.correctionFraction, 1.0f / 40 / 12 / 0.1f);
  EXPECT_EQ(easing.until(), (std::vector<std::uint64_t>{0, 120}));
}

TEST(SolverEasing, EndsAtItsTick) {
  const model::Scene before = twoCloths();
  model::Scene scene = before;
  scene.cloths[0].solver.kind = SolverKind::constraint;
  SolverEasing easing(2);
  easing.change(before, scene, 100);
  EXPECT_FALSE(easing.end(scene, 119));
  EXPECT_TRUE(easing.end(scene, 120));
  EXPECT_FALSE(scene.cloths[0].solver.correctionFraction);
  EXPECT_FALSE(easing.end(scene, 120));
}

TEST(SolverEasing, LaterChangesKeepTheLimit) {
  const model::Scene before = twoCloths();
  model::Scene eased = before;
  eased.cloths[0].solver.kind = SolverKind::constraint;
  SolverEasing easing(2);
  easing.change(before, eased, 100);
  // The message of a change has no correction fraction.
  model::Scene later = eased;
  later.cloths = SolverEasing::removedFrom(eased.cloths);
  easing.change(eased, later, 110);
  EXPECT_TRUE(later.cloths[0].solver.correctionFraction);
  EXPECT_EQ(easing.until()[0], 120u);
  later.cloths = SolverEasing::removedFrom(eased.cloths);
  easing.change(eased, later, 120);
  EXPECT_FALSE(later.cloths[0].solver.correctionFraction);
}

TEST(SolverEasing, ContinuesFromItsTicks) {
  model::Scene scene = twoCloths();
  scene.cloths[1].solver.correctionFraction = 0.02f;
  const SolverEasing easing(std::vector<std::uint64_t>{0, 120});
  EXPECT_FALSE(easing.end(scene, 119));
  EXPECT_TRUE(easing.end(scene, 120));
}

}  // namespace
}  // namespace clothstream::scene
