// SPDX-License-Identifier: MIT
// A collider as a tick sees it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/model/collider.h"

namespace clothstream::simulation {

// It moves in a straight line from start to end over the tick's substeps, and turns the shorter way, by the
// normalised mean of the two quaternions.
struct MovingCollider {
  model::Shape shape = model::Sphere{};
  model::Pose start = {}, end = {};
  float friction = 1;  // Coulomb; multiplied with the cloth's
};

// What a collider did to a cloth in a tick.
struct ContactStatus {
  std::uint32_t collider = 0, cloth = 0;
  double impulse = 0;  // N s: the sum of the sizes of what its nodes got, of each at least a millionth
};

// At most so many in a tick, and so many planes of their hulls in all.
inline constexpr std::size_t kMaxColliders = 8192;
inline constexpr std::size_t kMaxColliderPlanes = 16384;

}  // namespace clothstream::simulation
