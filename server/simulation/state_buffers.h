// SPDX-License-Identifier: MIT
// Buffers of a scene that several stages use.
#pragma once

#include <array>

#include "server/vulkan/buffer.h"

namespace clothstream::simulation {

// The buffers outlive the stages. The state alternates between two of them.
struct StateBuffers {
  const vulkan::Buffer& cloths;
  const vulkan::Buffer& colliders;        // CollisionStage::colliders()
  const vulkan::Buffer& nearColliders;    // CollisionStage::nearLists()
  const vulkan::Buffer& contactImpulses;  // CollisionStage::contactImpulses()
  // Two dispatch sizes by Follow, x, y, z each. If a spring may become too long, the forces of grids with
  // acad set the first x to the workgroups that find out (SolveStage::stretchGroups). A number for each node
  // follows. The forces set that of a walk to 1 if a spring at its nodes may be too long. Walks have
  // CLOTHSTREAM_SOLVE_WALK rows of a column. They are counted row by row from the cloth's first node.
  const vulkan::Buffer& stretches;
  std::array<const vulkan::Buffer*, 2> positions, velocities;
};

}  // namespace clothstream::simulation
