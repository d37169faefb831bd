// SPDX-License-Identifier: MIT
// Descriptor layout and pipelines of the renderer.
#pragma once

#include "clients/xr/render/passes.h"

namespace clothstream::xr {

enum class PipelineKind : std::size_t { kShadowMesh, kShadowSolid, kMesh, kSolid, kFloor, kSky, kQuad };
inline constexpr std::size_t kPipelineKinds = 7;

// Range of nodes for gather_normals.comp, its push constants.
struct NodeRange {
  std::uint32_t first = 0, end = 0;
};

class Pipelines {
 public:
  Pipelines(const GraphicsDevice& device, const RendererOptions& options, const Passes& passes);

  VkDescriptorSetLayout setLayout() const { return setLayout_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  VkPipeline get(PipelineKind kind) const { return graphics_[static_cast<std::size_t>(kind)].get(); }
  VkPipeline gatherNormals() const { return gatherNormals_.get(); }

 private:
  Owned<VkDescriptorSetLayout> setLayout_;
  Owned<VkPipelineLayout> layout_;
  Owned<VkPipelineCache> cache_;
  std::array<Owned<VkPipeline>, kPipelineKinds> graphics_;
  Owned<VkPipeline> gatherNormals_;
};

// Kind of the descriptor of a binding.
VkDescriptorType descriptorType(std::uint32_t binding);

}  // namespace clothstream::xr
