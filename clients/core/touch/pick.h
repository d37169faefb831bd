// SPDX-License-Identifier: MIT
// Points of the shown cloths: the nearest one to a point, and the first one that a ray meets.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "clients/core/core.h"
#include "clients/core/touch/vector.h"

namespace clothstream::client {

// Triangles with their corners: three indices of vertices each; three floats per vertex.
struct ShownCloths {
  std::span<const std::uint32_t> triangles;
  std::span<const float> positions;
};

// Return nullopt without a point within `maxDistance`, or if a number is not finite. Both look at every
// triangle. They leave the tick of the result at 0.
std::optional<cs_cloth_point> nearestPoint(const ShownCloths& cloths, const Vector& point, float maxDistance);
// The direction may have any length but 0.
std::optional<cs_cloth_point> castRay(const ShownCloths& cloths, const Vector& origin,
                                      const Vector& direction, float maxDistance);

}  // namespace clothstream::client
