// SPDX-License-Identifier: MIT
#include "server/simulation/cloth_skin/skin_limit_stage.h"

#include "kernels/limit_nodes.h"

namespace clothstream::simulation {

// The buffers that do not have the substep's start have its result.
SkinLimitStage::SkinLimitStage(const vulkan::Device& device, const ClothSkinStage& skins,
                               const StateBuffers& state, std::uint32_t workgroupSize)
    : count_(skins.limitCount()),
      limit_(bindStates(
          device, {device, kernels::limit_nodes, workgroupSize, {skins.hasBackstops() ? 1u : 0u}},
          [&](std::size_t from) {
            return BufferList{&skins.limits(), state.positions[1 - from], state.velocities[1 - from]};
          })) {}

void SkinLimitStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  recorder.barrier();
  recorder.dispatch(limit_[substep.from],
                    shared::LimitPush{.count = count_,
                                      .progress = substep.collision.progressAfter,
                                      .tickRate = substep.tick.rate,
                                      .reserved = 0},
                    count_);
}

}  // namespace clothstream::simulation
