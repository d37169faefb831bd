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
#include "server/simulation/solver_stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/simulation/xpbd_tables.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. A substep of [MMC16] starts from the free motion that the forces alone
// give. One or more Gauss-Seidel sweeps correct the springs in the order of model::springColours(), with
// multipliers that start from zero. Then velocities follow from the displacement of the nodes, and the nodes
// collide. The stage keeps no state between substeps.
class XpbdStage final : public SolverStage {
 public:
  // At least one cloth must have the solver xpbd. `workgroupSize` 0 and `wholeNodes` absent (nodes of the
  // largest cloth that one workgroup corrects) mean the measured best for the device. Throws
  // std::runtime_error if the device has too little memory.
  XpbdStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
            std::uint32_t workgroupSize, std::optional<std::uint32_t> wholeNodes);

  static bool isIn(std::span<const model::Cloth> cloths);

  void prepare(std::span<const shared::ClothRecord> cloths) override;
  // Corrects the free motion in place.
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

 private:
  // Code that the cloths need. The kernels leave out the rest; the bits are the same.
  struct Variant {
    bool damped, bend, colliders;
  };
  static Variant variantOf(std::span<const shared::ClothRecord> cloths, bool colliders);
  template <std::size_t count>
  using Variants = std::array<std::optional<StateBindings>, count>;  // made at their first use

  const StateBindings& grids(const Variant& variant, std::uint32_t passes);
  const StateBindings& meshes(const Variant& variant, bool whole);
  const StateBindings& finish(const Variant& variant);
  void recordTables(vulkan::Recorder& recorder) override;
  void recordWhole(vulkan::Recorder& recorder, std::uint32_t from, const Variant& variant);
  void recordParts(vulkan::Recorder& recorder, std::uint32_t from, const Variant& variant);

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
