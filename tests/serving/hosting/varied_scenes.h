// SPDX-License-Identifier: MIT
// Small scenes of all solvers and features, at several rates.
#pragma once

#include <cstddef>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::tests {

// One for each solver and its variants.
std::vector<model::Solver> variedSolvers();

// Scene "scene-NUMBER", with about a hundred nodes. The first 11 have all features and solvers, and the first
// 40 have them in 40 combinations. Fails the test if the scene is not valid.
model::Scene variedScene(std::size_t number);

}  // namespace clothstream::tests
