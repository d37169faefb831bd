// SPDX-License-Identifier: MIT
// The state of a scene's nodes on the CPU, exact to the bit, and its hash.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/attachment/grab.h"

namespace clothstream::simulation {

// A node that a grab holds.
struct HeldNode {
  std::uint32_t node = 0;      // in the scene
  std::uint32_t grab = 0;      // index into TickInputs::grabs
  model::Vec3 place{0, 0, 0};  // in the grab, m
  bool operator==(const HeldNode&) const = default;
};

// Nodes that the grabs of a tick hold. Both are empty if the tick had no grabs.
struct HeldNodes {
  std::vector<HeldNode> nodes = {};    // ascending by node
  std::vector<GrabStatus> grabs = {};  // by index into TickInputs::grabs
};

// What a substep has foreseen for the gas in a cloth; the next one compares it with what became of it.
struct GasState {
  float volume = 0;          // at its end, as a fraction of the volume at rest
  float squaredSubstep = 0;  // square of its length, s^2; 0: there was no gas
  bool operator==(const GasState&) const = default;
};

// Everything on the device that a later tick depends on: positions and velocities of all nodes, gas, and what
// grabs hold. Usable for another ClothSimulation of the same scene on any device. `bytes` has six
// little-endian floats per node, in order: position relative to `origin`, velocity.
struct StateSnapshot {
  std::uint64_t tick = 0;  // chosen by the caller
  std::vector<std::byte> bytes;
  HeldNodes held = {};
  model::Vec3 origin = model::Vec3::Zero();  // m
  std::vector<GasState> gas = {};            // one for each cloth, or empty: there was no gas
};
inline constexpr std::size_t kSnapshotBytesPerNode = 24;

// The state as numbers.
struct NodeState {
  std::vector<model::Vec3> positions, velocities;
  std::vector<GasState> gas = {};  // as in StateSnapshot
};
// A snapshot must have whole nodes, and a state as many velocities as positions. Positions of the result are
// relative to `origin`, zero for those in the world.
NodeState unpack(const StateSnapshot& snapshot, const model::Vec3& origin = model::Vec3::Zero());
StateSnapshot pack(const NodeState& state, std::uint64_t tick);
// The same snapshot with the positions in the world, rounded.
StateSnapshot inWorld(const StateSnapshot& snapshot);

// Status of a tick.
struct TickStatus {
  std::uint64_t stateHash = 0;  // of positions and velocities, bits
  // True: every component is finite and within kWorldExtent of zero (m; m/s), and no position is farther
  // from the origin of the simulation than the reach.
  bool healthy = true;
  // True: the state is unhealthy only because a position is out of reach, and so cannot be streamed.
  bool outOfReach = false;
  // Self-collision: number of lists of neighbours that were too long, plus number of balls that touched too
  // many others.
  std::uint32_t crowded = 0;
  // Box of all nodes in the world, if healthy.
  model::Vec3 low = model::Vec3::Zero(), high = model::Vec3::Zero();
};
inline constexpr float kWorldExtent = 8192;

// Computes the status of a state on the CPU. A device with the same bits reports the same status. `reach`:
// model::reachOf() of the scene's stream.
TickStatus statusOf(const StateSnapshot& snapshot, float reach = kWorldExtent);

}  // namespace clothstream::simulation
