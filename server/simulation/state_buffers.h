// SPDX-License-Identifier: MIT
// The buffers of a scene that several stages work on.
#pragma once

#include <array>

#include "server/vulkan/buffer.h"

namespace clothstream::simulation {

// They outlive the stages. State lies in two by turns.
struct StateBuffers {
  const vulkan::Buffer& cloths;
  const vulkan::Buffer& colliders;      // CollisionStage::colliders()
  const vulkan::Buffer& nearColliders;  // CollisionStage::nearLists()
  const vulkan::Buffer& contactImpulses;   // CollisionStage::contactImpulses()
  std::array<const vulkan::Buffer*, 2> positions, velocities;
};

}  // namespace clothstream::simulation
