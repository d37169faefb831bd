// SPDX-License-Identifier: MIT
// Grabs on cloth as a tick sees them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/model/pose.h"

namespace clothstream::simulation {

// A grab moves from start to end over the tick's substeps, as a MovingCollider does. Metres and newtons; the
// parameters are those of model::Grab.
struct Grab {
  enum class State : std::uint8_t {
    free,  // releases all of its nodes
    holds,
    takes,  // grabs nodes near its start
  };
  State state = State::free;
  model::Pose start = {}, end = {};
  float radius = 0.03f, reach = 0.1f;  // m, of a beginning grab
  float maxForce = 20;
  float slipDistance = 0.1f;
};

// Largest number of grabs in a tick.
inline constexpr std::size_t kMaxGrabs = 1024;

// Status of a grab after a tick.
struct GrabStatus {
  std::uint32_t taken = 0;    // nodes that it grabbed
  std::uint32_t slipped = 0;  // grabbed nodes that slipped away since
  bool operator==(const GrabStatus&) const = default;
};

}  // namespace clothstream::simulation
