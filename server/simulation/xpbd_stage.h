// SPDX-License-Identifier: MIT
// Extended position-based dynamics on the device: after the forces of a substep, springs are corrected in
// turn.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_buffers.h"
#include "server/simulation/xpbd_tables.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// What the kernels leave out where no cloth has it; the bits are the same.
struct XpbdVariant {
  bool damped, bend, colliders;
};

// Of the cloths' records, all of the scene.
XpbdVariant xpbdVariantOf(std::span<const shared::ClothRecord> cloths, bool colliders);

// Belongs to the device's thread. A substep of [MMC16]: from where the forces alone would take the nodes, one
// or more Gauss-Seidel sweeps over the springs in the order of model::springColours(), whose multipliers
// start from zero; then velocities from how far the nodes have come, and collisions. It has no state of its
// own.
class XpbdStage {
 public:
  // Some cloth's solver must be xpbd. `workgroupSize` 0, and `wholeNodes` (the largest cloth that one
  // workgroup corrects) absent: the measured best for the device. Throws std::runtime_error where there is no
  // room.
  XpbdStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
            std::uint32_t workgroupSize, std::optional<std::uint32_t> wholeNodes);

  // Its tables, once, before the first substep.
  void recordTables(vulkan::Recorder& recorder) const;
  // Makes the kernels of this variant now rather than when they are first needed.
  void prepare(const XpbdVariant& variant);
  // One substep whose free motion leads from state `from` to the other; corrects the latter in place. Begins
  // with a barrier.
  void record(vulkan::Recorder& recorder, std::uint32_t from, const XpbdVariant& variant,
              shared::FinishPush push);

 private:
  template <std::size_t count>
  using Stages = std::array<std::unique_ptr<Stage>, count>;  // made when they are first needed

  const Stage& grids(const XpbdVariant& variant, std::uint32_t passes);
  const Stage& meshes(const XpbdVariant& variant, bool whole);
  const Stage& finish(const XpbdVariant& variant);
  void recordWhole(vulkan::Recorder& recorder, std::uint32_t from, const XpbdVariant& variant);
  void recordParts(vulkan::Recorder& recorder, std::uint32_t from, const XpbdVariant& variant);

  const vulkan::Device& device_;
  StateBuffers state_;
  XpbdCut cut_;
  XpbdTables tables_;
  DeviceTable tiles_, colours_, links_;
  vulkan::Buffer multipliers_;
  Stages<16> grids_;
  Stages<4> meshes_;
  Stages<2> finish_;
};

}  // namespace clothstream::simulation
