// SPDX-License-Identifier: MIT
// Each kernel against the double-precision reference, one substep from random states.
#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;

// Half a unit in the last place, relative.
constexpr double kRounding = 1.0 / (1 << 24);

class Kernels : public GpuTest {
 protected:
  // Steps both from the same state, one substep, and compares them.
  // Tolerance: a spring's force is wrong by the rounding of its ends' difference (positions below 2 m are
  // within 2 * kRounding of where they are), times stiffness, and by some ten roundings of its own size, at
  // most stiffness times the stretched length; a node has twelve springs. That moves a velocity by h / m
  // times as much.
  static void expectLikeReference(scene::Scene scene, const simulation::TickInputs& inputs, unsigned seed,
                                  double extraForce = 0) {
    scene.substeps = 1;
    scene.simulationRate = 720;
    std::mt19937 random(seed);
    const NodeState start = randomState(scene, random, 0.005f, 1.0f);
    Running running(scene);
    running.restore(start);
    running.tick(inputs);
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    reference.tick(referenceInputs(inputs));

    const scene::Cloth& cloth = scene.cloths.front();
    const double length = 0.06;  // of the longest spring, displaced
    const double stiffness = cloth.structural.stiffness, damping = cloth.structural.damping;
    const double force =
        12 * (stiffness * (2 * 2 * kRounding + 10 * length * kRounding) + damping * 4 * 20 * kRounding) +
        extraForce;
    const double h = scene.substepSeconds(), nodeMass = 0.01;
    const double speed = h / nodeMass * force + 8 * kRounding;  // and of the velocity's own few roundings
    const double distance = h * speed + 2 * 2 * kRounding;
    const NodeState state = running.state();
    EXPECT_LT(largestSpeedDifference(state, reference), speed);
    EXPECT_LT(largestDistance(state, reference), distance);
    // It moved further than the tolerance: the comparison can fail.
    setState(reference, start);
    EXPECT_GT(largestDistance(state, reference), 100 * distance);
  }
};

TEST_F(Kernels, springsPullAsTheReference) {
  expectLikeReference(sceneOf({calmCloth(17, 23)}), inputsOf(sceneOf({})), 1);
}

}  // namespace
}  // namespace clothstream::tests
