// SPDX-License-Identifier: MIT
// Hash, health and box of the state at a tick's end.
#include "server/simulation/hash_stage.h"

#include <bit>

#include "kernels/hash_state.h"
#include "server/simulation/texel.h"
#include "shaders/shared/state_hash.h"

namespace clothstream::simulation {
namespace {

using vulkan::BufferPurpose;

// Number of invocations that fill the device.
std::uint64_t invocationsFor(const vulkan::Device& device, std::uint32_t nodes) {
  const std::uint64_t nodesPerInvocation = device.hasGpuKernels() ? 8 : 64;
  return (nodes + nodesPerInvocation - 1) / nodesPerInvocation;
}

}  // namespace

HashStage::HashStage(const vulkan::Device& device, const StateBuffers& state, std::uint32_t nodes,
                     const model::Vec3& origin, float reach, std::uint32_t workgroupSize)
    : nodes_(nodes),
      invocations_(invocationsFor(device, nodes)),
      origin_(origin),
      reach_(reach),
      status_(device, BufferPurpose::state, sizeof(shared::StatusRecord)),
      readback_(device, BufferPurpose::readback, 2 * sizeof(shared::StatusRecord)),
      hash_(bindStates(device, {device, kernels::hash_state, workgroupSize}, [&](std::size_t present) {
        return BufferList{state.positions[present], state.velocities[present], &status_};
      })) {}

void HashStage::recordInputs(vulkan::Recorder& recorder, const Tick&) {
  recorder.fill(status_, 0, status_.bytes());
}

void HashStage::recordEnd(vulkan::Recorder& recorder, const Tick&, std::uint32_t present,
                          const shared::CollisionPush&) {
  recorder.dispatch(hash_[present],
                    shared::HashPush{vectorOf(origin_), nodes_, std::bit_cast<std::uint32_t>(reach_)},
                    invocations_);
}

void HashStage::recordReport(vulkan::Recorder& recorder, const Tick& tick) {
  recorder.copy(status_, readback_, status_.bytes(), 0, tick.slot * status_.bytes());
}

TickStatus HashStage::status(std::uint32_t slot) const {
  const shared::StatusRecord& record = readback_.mapped<const shared::StatusRecord>()[slot];
  TickStatus status{.stateHash = std::uint64_t{record.hashHigh} << 32 | record.hashLow,
                    .healthy = record.unhealthy == 0,
                    .outOfReach = record.unhealthy == shared::kOutOfReach};
  for (int axis = 0; axis < 3; ++axis) {
    status.low[axis] = std::bit_cast<float>(shared::bitsInOrder(~record.invertedLow[axis]));
    status.high[axis] = std::bit_cast<float>(shared::bitsInOrder(record.high[axis]));
  }
  return status;
}

}  // namespace clothstream::simulation
