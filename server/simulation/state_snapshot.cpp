// SPDX-License-Identifier: MIT
// The state of a scene's nodes outside of the device, exact to the bit, and its hash.
#include "server/simulation/state_snapshot.h"

#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <limits>
#include <span>

#include "shaders/shared/state_hash.h"

namespace clothstream::simulation {

static_assert(std::endian::native == std::endian::little);
static_assert(sizeof(model::Vec3) == 12);

NodeState unpack(const StateSnapshot& snapshot, const model::Vec3& origin) {
  assert(snapshot.bytes.size() % kSnapshotBytesPerNode == 0);
  const std::size_t nodes = snapshot.bytes.size() / kSnapshotBytesPerNode;
  NodeState state{std::vector<model::Vec3>(nodes), std::vector<model::Vec3>(nodes)};
  const std::byte* from = snapshot.bytes.data();
  for (std::size_t i = 0; i < nodes; ++i, from += kSnapshotBytesPerNode) {
    std::memcpy(state.positions[i].data(), from, 12);
    std::memcpy(state.velocities[i].data(), from + 12, 12);
  }
  const model::Vec3 shift = snapshot.origin - origin;
  if (!shift.isZero(0))
    for (model::Vec3& position : state.positions) position += shift;
  state.gas = snapshot.gas;
  return state;
}

StateSnapshot pack(const NodeState& state, std::uint64_t tick) {
  assert(state.positions.size() == state.velocities.size());
  StateSnapshot snapshot{tick, std::vector<std::byte>(state.positions.size() * kSnapshotBytesPerNode)};
  std::byte* to = snapshot.bytes.data();
  for (std::size_t i = 0; i < state.positions.size(); ++i, to += kSnapshotBytesPerNode) {
    std::memcpy(to, state.positions[i].data(), 12);
    std::memcpy(to + 12, state.velocities[i].data(), 12);
  }
  snapshot.gas = state.gas;
  return snapshot;
}

StateSnapshot inWorld(const StateSnapshot& snapshot) {
  StateSnapshot moved = pack(unpack(snapshot), snapshot.tick);
  moved.held = snapshot.held;
  return moved;
}

TickStatus statusOf(const StateSnapshot& snapshot, float reach) {
  assert(snapshot.bytes.size() % kSnapshotBytesPerNode == 0);
  const auto nodes = static_cast<std::uint32_t>(snapshot.bytes.size() / kSnapshotBytesPerNode);
  shared::NodeHash sum{0, 0};
  bool isInWorld = true, isInReach = true;
  constexpr float kFar = std::numeric_limits<float>::max();
  model::Vec3 low = model::Vec3::Constant(kFar), high = -low;
  for (std::uint32_t i = 0; i < nodes; ++i) {
    std::array<std::uint32_t, 6> words;
    std::memcpy(words.data(), snapshot.bytes.data() + i * kSnapshotBytesPerNode, sizeof(words));
    const shared::NodeHash hash =
        shared::hashNode(i, words[0], words[1], words[2], words[3], words[4], words[5]);
    sum.low += hash.low;
    sum.high += hash.high;
    for (const std::uint32_t word : words) isInWorld = isInWorld && !shared::isOutsideWorld(word);
    for (std::size_t k = 0; k < 3; ++k)
      isInReach = isInReach && !shared::isBeyond(words[k], std::bit_cast<std::uint32_t>(reach));
    const model::Vec3 place(snapshot.origin.x() + std::bit_cast<float>(words[0]),
                            snapshot.origin.y() + std::bit_cast<float>(words[1]),
                            snapshot.origin.z() + std::bit_cast<float>(words[2]));
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  return {.stateHash = std::uint64_t{sum.high} << 32 | sum.low,
          .healthy = isInWorld && isInReach,
          .outOfReach = isInWorld && !isInReach,
          .low = low,
          .high = high};
}

}  // namespace clothstream::simulation
