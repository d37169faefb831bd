// SPDX-License-Identifier: MIT
// The point near which a scene is computed.
#pragma once

#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

// Grid of the origins of scenes, m. Subtracting a multiple of a power of two rounds nothing.
inline constexpr float kOriginStep = 64;

// Simulations and streams keep positions relative to this point, because numbers near zero are finer: the
// middle of the cloths at the start, rounded to multiples of kOriginStep. Zero for scenes near the origin of
// the world.
Vec3 originOf(const Scene& scene);
// The same for one cloth.
Vec3 originOf(const Cloth& cloth);

// Largest distance along an axis of a node's start position from a point, m.
float farthestFrom(const Vec3& point, const Cloth& cloth);

// Rest positions of the nodes relative to a point.
std::vector<Vec3> restPositions(const Cloth& cloth, const Vec3& origin);

}  // namespace clothstream::model
