// SPDX-License-Identifier: MIT
// Extended position-based dynamics on the device: after the forces of a substep, it corrects the springs one
// after the other.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/device_table.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/simulation/xpbd_tables.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Code that the cloths need. The kernels leave out the rest; the bits are the same.
struct XpbdVariant {
  bool damped, bend, colliders;
};

// Variant for the records of all cloths of the scene.
XpbdVariant xpbdVariantOf(std::span<const shared::ClothRecord> cloths, bool colliders);

// Belongs to the device's thread. A substep of [MMC16] starts from the free motion that the forces alone
// give. One or more Gauss-Seidel sweeps correct the springs in the order of model::springColours(), with
// multipliers that start from zero. Then velocities follow from the displacement of the nodes, and the nodes
// collide. The stage keeps no state between substeps.
class XpbdStage {
 public:
  // At least one cloth must have the solver xpbd. `workgroupSize` 0 and `wholeNodes` absent (nodes of the
  // largest cloth that one workgroup corrects) mean the measured best for the device. Throws
  // std::runtime_error if the device has too little memory.
  XpbdStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
            std::uint32_t workgroupSize, std::optional<std::uint32_t> wholeNodes);

  // Uploads the tables, once, before the first substep.
  void recordTables(vulkan::Recorder& recorder) const;
  // Creates the kernels of this variant now instead of at their first use.
  void prepare(const XpbdVariant& variant);
  // Records one substep. The free motion led from state `from` to the other state, which is corrected in
  // place. Begins with a barrier.
  void record(vulkan::Recorder& recorder, std::uint32_t from, const XpbdVariant& variant,
              shared::FinishPush push);

 private:
  template <std::size_t count>
  using Variants = std::array<std::optional<StateBindings>, count>;  // made at their first use

  const StateBindings& grids(const XpbdVariant& variant, std::uint32_t passes);
  const StateBindings& meshes(const XpbdVariant& variant, bool whole);
  const StateBindings& finish(const XpbdVariant& variant);
  void recordWhole(vulkan::Recorder& recorder, std::uint32_t from, const XpbdVariant& variant);
  void recordParts(vulkan::Recorder& recorder, std::uint32_t from, const XpbdVariant& variant);

  const vulkan::Device& device_;
  StateBuffers state_;
  XpbdCut cut_;
  XpbdTables tables_;
  DeviceTable tiles_, colours_, links_;
  vulkan::Buffer multipliers_;
  Variants<16> grids_;
  Variants<4> meshes_;
  Variants<2> finish_;
};

}  // namespace clothstream::simulation
