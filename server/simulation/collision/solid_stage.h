// SPDX-License-Identifier: MIT
// Collision with the triangle meshes of a scene, at the end of each substep.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/collision/solid_tables.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Meshes of a scene on the device.
class SolidStage final : public Stage {
 public:
  // `tables` are those of the scene's colliders.
  SolidStage(const vulkan::Device& device, const SolidTables& tables, std::span<const model::Cloth> cloths,
             const StateBuffers& state, std::uint32_t workgroupSize);

  // Collides all nodes with the meshes, which are the colliders from number collision.colliderCount on.
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

  const vulkan::Buffer& solids() const { return solids_.texels(); }
  // Constants of the kernels that include distance_grid.glsl.
  std::span<const std::uint32_t> specialisation() const { return collide_[0].kernel().specialisation(); }

 private:
  void recordTables(vulkan::Recorder& recorder) override;

  std::uint32_t workgroupSize_;
  std::uint32_t tileCount_;
  std::uint64_t workOfSolid_ = 0;  // of the costliest mesh, for each node, in node-steps
  std::uint64_t mostOfSolid_ = 0;  // that its search may take
  DeviceTable solids_, tiles_;
  StateBindings collide_;
  // A mesh whose distances are sampled.
  struct Sampled {
    shared::SamplePush push;
    std::uint64_t points = 0;
    std::uint64_t work = 0;  // of a point, in node-steps
  };
  std::vector<Sampled> sampled_;
  std::optional<vulkan::Bindings> sample_;  // absent if no mesh is
};

}  // namespace clothstream::simulation
