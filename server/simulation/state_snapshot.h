// SPDX-License-Identifier: MIT
// The state of a scene's nodes outside of the device, exact to the bit, and its hash.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::simulation {

// Positions and velocities of all nodes. Good for another ClothSimulation of the same scene on any device.
// bytes: for each node, in order, six little-endian floats: position, velocity.
struct StateSnapshot {
  std::uint64_t tick = 0;  // the caller's
  std::vector<std::byte> bytes;
};
inline constexpr std::size_t kSnapshotBytesPerNode = 24;

// The same as numbers.
struct NodeState {
  std::vector<model::Vec3> positions, velocities;
};
// The snapshot must hold whole nodes, the state as many velocities as positions.
NodeState unpack(const StateSnapshot& snapshot);
StateSnapshot pack(const NodeState& state, std::uint64_t tick);

// What the device reports of a tick.
struct TickStatus {
  std::uint64_t stateHash = 0;  // of positions and velocities, bits
  bool healthy = true;          // every component finite, and within kWorldExtent of zero (m; m/s)
  // Self-collision: how many lists of neighbours were too long, and how often a ball touched too many.
  std::uint32_t crowded = 0;
};
inline constexpr float kWorldExtent = 8192;

// The status of a state, computed on the CPU: what a device holding the same bits reports.
TickStatus statusOf(const StateSnapshot& snapshot);

}  // namespace clothstream::simulation
