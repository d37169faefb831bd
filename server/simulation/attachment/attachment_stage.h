// SPDX-License-Identifier: MIT
// What holds cloth, on the device: nodes attached to moving frames, tethers, participants' grabs.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/model/pose.h"
#include "server/model/scene.h"
#include "server/simulation/device_table.h"
#include "server/simulation/attachment/grab.h"
#include "server/simulation/attachment/attachment_tables.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread.
//
// A tick:   recordInputs -> barrier -> recordAim -> substeps, each with recordSubstep at its end ->
// recordReport
class AttachmentStage {
 public:
  // Throws std::runtime_error where the device has no room.
  AttachmentStage(const vulkan::Device& device, const AttachmentTables& tables, const StateBuffers& state,
            std::uint32_t nodeCount, std::uint32_t workgroupSize);

  // Of the tethers of these cloths, from the next tick on: to be called before the first.
  void setSlack(std::span<const model::Cloth> cloths);

  // `frames`: where each attachment of the tables is at the tick's end; none: where they start. At most one
  // tick may be in flight.
  void recordInputs(vulkan::Recorder& recorder, std::span<const model::Pose> frames,
                    std::span<const Grab> grabs);
  // Whether recordAim() has something to do in this tick.
  bool aims() const { return attachedCount_ > 0 || takes_; }
  // Attached nodes get their velocities, grabs that begin take hold; the state lies in the buffers `present`.
  void recordAim(vulkan::Recorder& recorder, std::uint32_t present, float tickRate);
  // The substep's result lies in the buffers that are not `present`.
  void recordSubstep(vulkan::Recorder& recorder, std::uint32_t present, std::uint32_t substep,
                     std::uint32_t substeps, float tickRate);
  void recordReport(vulkan::Recorder& recorder);

  // Of the grabs of the last recorded tick, once it is complete.
  std::span<const shared::GrabReport> report() const;

 private:
  Stage makePull(const vulkan::Device& device, const StateBuffers& state, bool grabs) const;
  // They share the nodes.
  std::uint64_t invocations() const;

  std::uint32_t workgroupSize_, nodeCount_, attachedCount_;
  bool hasTethers_;
  bool tabled_ = false;    // what does not change is on the device
  bool slackened_ = true;  // the tethers are
  bool takes_ = false;     // some grab takes hold in this tick
  std::uint32_t grabCount_ = 0, slot_ = 0;

  DeviceTable attached_, tethers_;
  std::vector<shared::TetherRecord> restTethers_;  // without slack
  std::vector<float> longer_;                      // by which each cloth's are, as the table has them
  std::vector<shared::FrameRecord> startFrames_;
  vulkan::Buffer frames_, grabs_, grabbed_, reports_;
  // By turns: a tick may be in flight while the next is recorded.
  std::array<vulkan::Buffer, 2> uploads_;  // frames, then grabs
  std::array<vulkan::Buffer, 2> readbacks_;
  Stage aim_, findNearest_, beginGrabs_, tie_, pull_;
};

}  // namespace clothstream::simulation
