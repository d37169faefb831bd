// SPDX-License-Identifier: MIT
// Colliders as the kernels read them.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "server/simulation/collision/moving_collider.h"
#include "server/simulation/collision/solid_tables.h"
#include "shaders/collision/collision.h"

namespace clothstream::simulation {

struct ColliderTables {
  std::vector<shared::ColliderRecord> records;
  std::vector<shared::vec4> planes;  // of planes and hulls, as records number them
  // Bounds of each group of kColliderGroup consecutive colliders, then of each collider.
  std::vector<shared::ColliderBounds> bounds;
};

// Replaces the contents of `tables` and reuses its memory. At most kMaxColliders, with kMaxColliderPlanes in
// total. Triangle meshes are the last of the colliders, and `solids` has them; they have no bounds.
void fill(ColliderTables& tables, std::span<const MovingCollider* const> colliders,
          const SolidTables& solids);

}  // namespace clothstream::simulation
