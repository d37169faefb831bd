// SPDX-License-Identifier: MIT
// Runs stress scenes and checks every tick.
#pragma once

#include "tests/simulation/stress_scenes.h"

namespace clothstream::tests {

// Expects that no edge is in a triangle, and that no node is deeper than 5 cm inside a collider, after each
// of the first `ticks` ticks.
void expectNoIntersection(const StressScene& stress, int ticks);

}  // namespace clothstream::tests
