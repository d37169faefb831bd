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
  // Dispatch sizes, x, y, z by Follow. The forces of grids with acad set x to the chunks of their SolveGroup
  // if a spring may become too long.
  const vulkan::Buffer& stretches;
  std::array<const vulkan::Buffer*, 2> positions, velocities;
};

}  // namespace clothstream::simulation
