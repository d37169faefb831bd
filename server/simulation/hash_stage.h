// SPDX-License-Identifier: MIT
// Hash, health and box of the state at a tick's end.
#pragma once

#include <cstdint>

#include "server/model/scene.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

class HashStage final : public Stage {
 public:
  // Positions are relative to `origin`; one that is farther than `reach` (m) from it is unhealthy.
  HashStage(const vulkan::Device& device, const StateBuffers& state, std::uint32_t nodes,
            const model::Vec3& origin, float reach, std::uint32_t workgroupSize);

  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  void recordEnd(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present,
                 const shared::CollisionPush& collision) override;
  void recordReport(vulkan::Recorder& recorder, const Tick& tick) override;
  // Status of the tick with this slot, once it is complete, without the crowded lists.
  TickStatus status(std::uint32_t slot) const;

 private:
  std::uint32_t nodes_;
  std::uint64_t invocations_;  // they share the nodes
  model::Vec3 origin_;
  float reach_;
  vulkan::Buffer status_, readback_;
  StateBindings hash_;
};

}  // namespace clothstream::simulation
