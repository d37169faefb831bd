// SPDX-License-Identifier: MIT
// Attachments, tethers and grabs on the device.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/jump.h"
#include "server/model/pose.h"
#include "server/model/scene.h"
#include "server/simulation/attachment/attachment_tables.h"
#include "server/simulation/attachment/grabbed_nodes.h"
#include "server/simulation/attachment/tether_table.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Moves attached nodes with their frames and grabbed ones with their grabs, and keeps tethered ones near.
class AttachmentStage final : public Stage {
 public:
  // Throws std::runtime_error where the device has no room.
  AttachmentStage(const vulkan::Device& device, const AttachmentTables& tables, const StateBuffers& state,
                  std::span<const std::uint32_t> clothOffsets, std::uint32_t workgroupSize);

  // Sets the slack of the tethers. With tethers it must be called before the first tick.
  void setCloths(std::span<const model::Cloth> cloths) override;

  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  // Carries cloths along, gives attached nodes their velocities, and lets grabs begin. Stage "attachments".
  void recordStart(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present) override;
  // Applies tethers and grabs to the substep's end.
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;
  void recordReport(vulkan::Recorder& recorder, const Tick& tick) override;

  // Reports of the grabs of the last recorded tick, which has this slot, once it is complete.
  std::span<const shared::GrabReport> report(std::uint32_t slot) const;

  // Copies what the grabs of the last recorded tick hold to the CPU. collect() returns it once the recording
  // is complete. The caller records a barrier before and after each recording.
  void recordSave(vulkan::Recorder& recorder) { grabbed_.recordSave(recorder, grabCount_); }
  HeldNodes collect() const { return grabbed_.collect(); }
  // Replaces what grabs hold. Numbers of nodes and grabs must be in range. No earlier recording may be in
  // flight.
  void recordRestore(vulkan::Recorder& recorder, const HeldNodes& held);

 private:
  void recordTables(vulkan::Recorder& recorder) override;
  void recordCarries(vulkan::Recorder& recorder, std::uint32_t present,
                     std::span<const model::Carry> carries) const;
  StateBindings bindPull(const vulkan::Device& device, const StateBuffers& state, std::uint32_t workgroupSize,
                         bool grabs) const;
  // Number of invocations, which share the nodes.
  std::uint64_t invocations() const;

  std::vector<std::uint32_t> clothOffsets_;
  std::uint32_t nodeCount_, attachedCount_;
  bool takes_ = false;  // a grab begins in this tick
  std::uint32_t grabCount_ = 0;

  DeviceTable attached_;
  TetherTable tethers_;
  std::vector<shared::FrameRecord> startFrames_;
  vulkan::Buffer frames_, grabs_;
  GrabbedNodes grabbed_;
  // By Tick::slot, because a tick may be in flight while the next one is recorded.
  std::array<vulkan::Buffer, 2> uploads_;  // frames, then grabs
  StateBindings carry_, aim_, findNearest_, beginGrabs_, tie_, pull_;
};

}  // namespace clothstream::simulation
