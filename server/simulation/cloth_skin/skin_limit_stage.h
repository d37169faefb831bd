// SPDX-License-Identifier: MIT
// Limits on the distance of nodes from their skinned places, in each substep.
#pragma once

#include <cstdint>

#include "server/simulation/cloth_skin/cloth_skin_stage.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Acts after collision with everything, so that a node is never farther from its skinned place than it may
// be.
class SkinLimitStage final : public Stage {
 public:
  // `skins` has nodes with limits, and outlives the stage.
  SkinLimitStage(const vulkan::Device& device, const ClothSkinStage& skins, const StateBuffers& state,
                 std::uint32_t workgroupSize);

  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

 private:
  std::uint32_t count_;
  StateBindings limit_;
};

}  // namespace clothstream::simulation
