// SPDX-License-Identifier: MIT
// A collider during one tick.
#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "server/model/collider.h"

namespace clothstream::simulation {

// Moves in a straight line from start to end over the tick's substeps. Rotates the shorter way, by the
// normalised mean of the two quaternions.
struct MovingCollider {
  model::Shape shape = model::Sphere{};
  model::Pose start = {}, end = {};
  float friction = 1;  // Coulomb; multiplied with the cloth's
  // Poses of the joints of a mesh in the frame of the collider, or empty. Vertices move in straight lines.
  std::vector<model::Pose> jointsStart = {}, jointsEnd = {};
  // True: it or its joints jumped to the tick's start, from `before` and `jointsBefore`, or the cloth went
  // back to a state when they were there. Cloth that follows the joints goes along.
  bool jumped = false;
  model::Pose before = {};
  std::vector<model::Pose> jointsBefore = {};
};

// Lets a collider of the scene jump if the way to its end, or that of its joints, is too far for a tick
// (model::hasJumped), or if its joints must jump.
void jump(MovingCollider& collider, double tickSeconds, bool jointsMust = false);

inline bool isSolid(const MovingCollider& collider) {
  return std::holds_alternative<model::Solid>(collider.shape);
}

// Effect of a collider on a cloth in a tick.
struct ContactStatus {
  std::uint32_t collider = 0, cloth = 0;
  double impulse = 0;  // N s, sum of the impulses on the cloth's nodes; each counts at least 1e-6
};

// Largest number of colliders in a tick, and of planes of their shapes in total.
inline constexpr std::size_t kMaxColliders = 8192;
inline constexpr std::size_t kMaxColliderPlanes = 16384;

}  // namespace clothstream::simulation
