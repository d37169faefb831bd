// SPDX-License-Identifier: MIT
// Limits of the size of scenes that peers create.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "server/messages/limits.h"
#include "server/model/cancellation.h"

namespace clothstream::messages {

// Limits of a scene, in addition to those of limits.h.
struct SceneLimits {
  std::uint64_t nodes = limits::kMaxNodes;
  std::uint32_t nodeSprings = limits::kMaxNodeSprings;  // of one node of a mesh
  std::uint64_t springs = std::numeric_limits<std::uint64_t>::max();
  std::size_t attachments = std::numeric_limits<std::size_t>::max();
  model::Cancellation cancellation = {};
};

}  // namespace clothstream::messages
