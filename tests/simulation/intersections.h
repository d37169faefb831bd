// SPDX-License-Identifier: MIT
// Counts the places where a cloth passes through itself or through another cloth.
#pragma once

#include <cstddef>
#include <span>

#include "server/model/scene.h"

namespace clothstream::tests {

// Number of times that an edge of one triangle pierces another triangle of the scene. Triangles with a common
// node do not count.
std::size_t intersections(const model::Scene& scene, std::span<const model::Vec3> positions);

}  // namespace clothstream::tests
