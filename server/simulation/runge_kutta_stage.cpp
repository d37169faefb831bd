// SPDX-License-Identifier: MIT
// The fourth-order Runge-Kutta method on the device.
#include "server/simulation/runge_kutta_stage.h"

#include "kernels/combine_runge_kutta.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::uint32_t kWorkgroup = 64;

// Length of each explicit Euler step, as a part of the substep.
constexpr std::array<float, 4> kParts{0.5f, 0.5f, 1.0f, 1.0f / 6};

Buffer makeBuffer(const vulkan::Device& device, BufferPurpose purpose, std::uint32_t nodes) {
  return Buffer(device, purpose, nodes * sizeof(shared::vec4));
}

}  // namespace

RungeKuttaStage::RungeKuttaStage(const vulkan::Device& device, const StateBuffers& state,
                                 std::span<const std::uint32_t> clothOffsets)
    : offsets_(clothOffsets.begin(), clothOffsets.end()),
      start_(makeBuffer(device, BufferPurpose::texels, offsets_.back())),
      startVelocities_(makeBuffer(device, BufferPurpose::state, offsets_.back())),
      sums_(makeBuffer(device, BufferPurpose::state, offsets_.back())),
      velocitySums_(makeBuffer(device, BufferPurpose::state, offsets_.back())),
      combine_{bindCombine(device, state, 0), bindCombine(device, state, 1), bindCombine(device, state, 2),
               bindCombine(device, state, 3)} {}

StateBindings RungeKuttaStage::bindCombine(const vulkan::Device& device, const StateBuffers& state,
                                           std::uint32_t stage) const {
  return bindStates(device, {device, kernels::combine_runge_kutta, kWorkgroup, {stage + 1}},
                    [&](std::size_t from) {
                      const std::size_t to = 1 - from;
                      return BufferList{&state.cloths,
                                        &state.colliders,
                                        &state.nearColliders,
                                        &start_,
                                        state.positions[from],
                                        state.velocities[from],
                                        state.positions[to],
                                        state.velocities[to],
                                        &start_,
                                        &startVelocities_,
                                        &sums_,
                                        &velocitySums_,
                                        &state.contactImpulses};
                    });
}

void RungeKuttaStage::record(vulkan::Recorder& recorder, std::uint32_t from,
                             const shared::CollisionPush& collision, const RecordEuler& recordEuler) const {
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    const std::size_t stepFrom = stage % 2 == 0 ? from : 1 - from;
    if (stage > 0) recorder.barrier();
    recordEuler(static_cast<std::uint32_t>(stepFrom), kParts[stage]);
    shared::RungeKuttaPush push{
        .collision = collision, .firstNode = 0, .count = offsets_.back(), .cloth = 0, .reserved = 0};
    if (stage + 1 < kStages) {
      recorder.barrier();
      recorder.dispatch(combine_[stage][stepFrom], push, push.count);
      continue;
    }
    // Each cloth has its own friction and thickness.
    for (; push.cloth + 1 < offsets_.size(); ++push.cloth) {
      push.firstNode = offsets_[push.cloth];
      push.count = offsets_[push.cloth + 1] - push.firstNode;
      recorder.barrier();
      recorder.dispatch(combine_[stage][stepFrom], push, push.count, collision.nodeWork);
    }
  }
}

}  // namespace clothstream::simulation
