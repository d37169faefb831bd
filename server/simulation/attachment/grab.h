// SPDX-License-Identifier: MIT
// Grabs on cloth as a tick sees them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/model/pose.h"

namespace clothstream::simulation {

// It moves from start to end over the tick's substeps, as a MovingCollider does. Metres, newtons; as
// model::Grab.
struct Grab {
  enum class State : std::uint8_t {
    free,  // lets go of what it held
    holds,
    takes,  // hold of nodes near its start
  };
  State state = State::free;
  model::Pose start = {}, end = {};
  float radius = 0.03f, reach = 0.1f;  // of one that takes hold
  float maxForce = 20;
  float slipDistance = 0.1f;
};

// At most so many in a tick.
inline constexpr std::size_t kMaxGrabs = 1024;

// What a grab holds after a tick.
struct GrabStatus {
  std::uint32_t taken = 0;    // nodes that it took hold of
  std::uint32_t slipped = 0;  // those of them that slipped away since
};

}  // namespace clothstream::simulation
