// SPDX-License-Identifier: MIT
// A collider as a tick sees it.
#pragma once

#include <cstddef>

#include "server/scene/collider.h"

namespace clothstream::simulation {

// It moves in a straight line from start to end over the tick's substeps, and turns the shorter way, by the
// normalised mean of the two quaternions.
struct MovingCollider {
  scene::Shape shape = scene::Sphere{};
  scene::Pose start = {}, end = {};
  float friction = 1;  // Coulomb; multiplied with the cloth's
};

// At most so many in a tick, and so many planes of their hulls in all.
inline constexpr std::size_t kMaxColliders = 4096;
inline constexpr std::size_t kMaxColliderPlanes = 16384;

}  // namespace clothstream::simulation
