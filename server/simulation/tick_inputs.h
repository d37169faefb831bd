// SPDX-License-Identifier: MIT
// Inputs of a tick.
#pragma once

#include <cstdint>
#include <vector>

#include "server/model/jump.h"
#include "server/model/scene.h"
#include "server/simulation/attachment/grab.h"
#include "server/simulation/collision/moving_collider.h"
#include "server/simulation/collision/surface_table.h"

namespace clothstream::simulation {

// Inputs of one tick. All values are validated before.
struct TickInputs {
  model::Environment environment;
  std::vector<MovingCollider> colliders;  // at most kMaxColliders, in the order in which they act
  // At most model::kMaxLocalWinds, in addition to the wind of the environment, in the order in which they add
  // up.
  std::vector<model::LocalWind> winds = {};
  bool reportsContacts = false;   // true: contacts() reports this tick
  bool namesConstraints = false;  // true: a report of this tick has constraintEnds()
  // Pose of each attachment at the tick's end, in the order of the scene's cloths. Empty: the poses at the
  // start.
  std::vector<model::Pose> attachments = {};
  // Cloths that move as rigid bodies at the tick's start, because their attachments jump.
  std::vector<model::Carry> carries = {};
  // At most kMaxGrabs. A grab keeps its index while it is active. An index must be free for one tick before
  // another grab uses it.
  std::vector<Grab> grabs = {};
  // At most model::kMaxSceneSurfaces, in the order in which they act: surfaces of the real room, which stand
  // still in the tick. They have at most model::kMaxSceneSurfaceTriangles together.
  std::vector<PlacedSurface> surfaces = {};
  // Surfaces that later ticks will have: the tick uploads a part of them, and does not depend on them.
  std::vector<SharedSurface> arriving = {};
};

// Inputs that the scene itself gives to a tick (from 0): its wind, its colliders and its attachments. A
// collider that jumps is at its new pose from the tick's start.
TickInputs inputsAt(const model::Scene& scene, std::uint64_t tick);

}  // namespace clothstream::simulation
