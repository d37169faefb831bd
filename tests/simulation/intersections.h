// SPDX-License-Identifier: MIT
// Where a cloth passes through itself or through another.
#pragma once

#include <cstddef>
#include <span>

#include "server/model/scene.h"

namespace clothstream::tests {

// How often an edge of one triangle pierces another triangle of the scene with which it has no node in
// common.
std::size_t intersections(const model::Scene& scene, std::span<const model::Vec3> positions);

}  // namespace clothstream::tests
