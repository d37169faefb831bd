// SPDX-License-Identifier: MIT
// Converts the state of a scene on the device between its message and the simulation, exact to the bit.
#pragma once

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "clothstream/v1/recording.pb.h"
#include "server/simulation/state_snapshot.h"

namespace clothstream::scene {

// Sets tick, state and grabs of the message.
void write(const simulation::StateSnapshot& snapshot, v1::Checkpoint& message);

// The error says how the message does not fit a scene with this number of nodes. Numbers of nodes and grabs
// in the result are in range.
[[nodiscard]] tl::expected<simulation::StateSnapshot, std::string> toSnapshot(const v1::Checkpoint& message,
                                                                              std::uint32_t nodeCount);

}  // namespace clothstream::scene
