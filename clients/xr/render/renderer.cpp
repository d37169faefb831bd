// SPDX-License-Identifier: MIT
#include "clients/xr/render/renderer.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "clients/xr/render/frame_data.h"
#include "clients/xr/render/light.h"

namespace clothstream::xr {
namespace {

constexpr std::uint32_t kMostGroups = 65'535;  // that every device can dispatch at once

bool encodesByItself(VkFormat format) {
  switch (format) {
    case VK_FORMAT_R8G8B8A8_SRGB:
    case VK_FORMAT_B8G8R8A8_SRGB:
    case VK_FORMAT_A8B8G8R8_SRGB_PACK32:
    case VK_FORMAT_R16G16B16A16_SFLOAT:
      return true;
    default:
      return false;
  }
}

void setViewport(VkCommandBuffer commands, VkExtent2D size) {
  const VkViewport viewport{0, 0, static_cast<float>(size.width), static_cast<float>(size.height), 0, 1};
  const VkRect2D scissor{{0, 0}, size};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &scissor);
}

}  // namespace

struct Renderer::Parts {
  Parts(const GraphicsDevice& graphics, const RendererOptions& rendererOptions)
      : device(graphics),
        options(rendererOptions),
        passes(graphics, rendererOptions),
        pipelines(graphics, rendererOptions, passes),
        textures(graphics),
        data(graphics, pipelines, passes, textures) {
    setLight(frame);
    frame.encodes = encodesByItself(options.colour) ? 0 : 1;
    data.upload(Stage{});  // so that a stage without cloths needs no upload
  }

  void gatherNormals(VkCommandBuffer commands, const Stage& stage) const;
  void drawShadows(VkCommandBuffer commands, const Stage& stage) const;
  void drawPicture(VkCommandBuffer commands, const Target& target, const Stage& stage, VkDescriptorSet set,
                   std::uint32_t quads);
  void drawMeshes(VkCommandBuffer commands, const Stage& stage, PipelineKind kind) const;
  void drawSolids(VkCommandBuffer commands, SolidClass which, PipelineKind kind) const;
  void bind(VkCommandBuffer commands, PipelineKind kind) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipelines.get(kind));
  }

  GraphicsDevice device;
  RendererOptions options;
  Passes passes;
  Pipelines pipelines;
  Textures textures;
  FrameData data;
  shaders::Frame frame{};
};

Renderer::Renderer(const GraphicsDevice& device, const RendererOptions& options)
    : parts_(std::make_unique<Parts>(device, options)) {
  assert(options.views == 1 || options.views == 2);
}

Renderer::~Renderer() {
  if (parts_) vkDeviceWaitIdle(parts_->device.device);
}

void Renderer::upload(const Stage& stage) {
  check(vkDeviceWaitIdle(parts_->device.device), "vkDeviceWaitIdle");
  parts_->data.upload(stage);
}

void Renderer::forgetTargets() {
  parts_->passes.forgetTargets();
}

void Renderer::record(VkCommandBuffer commands, const Target& target, std::span<const View> views,
                      const Stage& stage) {
  Parts& parts = *parts_;
  assert(views.size() == parts.options.views);
  assert(stage.topology == parts.data.topology());
  fitToStage(stage, parts.frame);
  const VkDescriptorSet set = parts.data.write(stage, views, parts.frame);
  parts.textures.record(commands, stage, parts.data.staging());
  const std::uint32_t quads = parts.data.writeQuads(stage, views, parts.textures);
  const VkPipelineLayout layout = parts.pipelines.layout();
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &set, 0, nullptr);
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, layout, 0, 1, &set, 0, nullptr);
  parts.gatherNormals(commands, stage);
  parts.drawShadows(commands, stage);
  parts.drawPicture(commands, target, stage, set, quads);
}

void Renderer::Parts::gatherNormals(VkCommandBuffer commands, const Stage& stage) const {
  // Normals of the stream are those of the cloths.
  NodeRange range{stage.normals.empty() ? 0 : stage.clothNodeCount, stage.nodeCount};
  if (range.first >= range.end) return;
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines.gatherNormals());
  for (; range.first < range.end; range.first += kMostGroups * shaders::kNodesPerGroup) {
    const std::uint32_t groups =
        (range.end - range.first + shaders::kNodesPerGroup - 1) / shaders::kNodesPerGroup;
    vkCmdPushConstants(commands, pipelines.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(range), &range);
    vkCmdDispatch(commands, std::min(groups, kMostGroups), 1, 1);
  }
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_VERTEX_SHADER_BIT, 0,
                       1, &barrier, 0, nullptr, 0, nullptr);
}

void Renderer::Parts::drawShadows(VkCommandBuffer commands, const Stage& stage) const {
  VkClearValue clear{};
  clear.depthStencil.depth = 1;
  constexpr VkExtent2D kSize{kShadowTexels, kShadowTexels};
  VkRenderPassBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
  begin.renderPass = passes.shadow();
  begin.framebuffer = passes.shadowFramebuffer();
  begin.renderArea = {{0, 0}, kSize};
  begin.clearValueCount = 1;
  begin.pClearValues = &clear;
  vkCmdBeginRenderPass(commands, &begin, VK_SUBPASS_CONTENTS_INLINE);
  setViewport(commands, kSize);
  drawMeshes(commands, stage, PipelineKind::kShadowMesh);
  drawSolids(commands, SolidClass::kOpaque, PipelineKind::kShadowSolid);
  vkCmdEndRenderPass(commands);
}

void Renderer::Parts::drawPicture(VkCommandBuffer commands, const Target& target, const Stage& stage,
                                  VkDescriptorSet set, std::uint32_t quads) {
  std::array<VkClearValue, 2> clear{};
  clear[1].depthStencil.depth = 1;
  VkRenderPassBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
  begin.renderPass = passes.picture(target.depth != VK_NULL_HANDLE);
  begin.framebuffer = passes.framebuffer(target);
  begin.renderArea = {{0, 0}, target.size};
  begin.clearValueCount = clear.size();
  begin.pClearValues = clear.data();
  vkCmdBeginRenderPass(commands, &begin, VK_SUBPASS_CONTENTS_INLINE);
  // A pass with multiview begins without anything bound.
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipelines.layout(), 0, 1, &set, 0,
                          nullptr);
  setViewport(commands, target.size);
  drawSolids(commands, SolidClass::kHides, PipelineKind::kSolid);
  drawSolids(commands, SolidClass::kOpaque, PipelineKind::kSolid);
  drawMeshes(commands, stage, PipelineKind::kMesh);
  if (stage.background != Background::kAdditive) {
    bind(commands, PipelineKind::kFloor);
    vkCmdDraw(commands, 6, 1, 0, 0);
  }
  if (stage.background == Background::kRoom) {
    bind(commands, PipelineKind::kSky);
    vkCmdDraw(commands, 3, 1, 0, 0);
  }
  drawSolids(commands, SolidClass::kFaint, PipelineKind::kSolid);
  if (quads > 0) {
    bind(commands, PipelineKind::kQuad);
    vkCmdDraw(commands, 6, quads, 0, 0);
  }
  vkCmdEndRenderPass(commands);
}

void Renderer::Parts::drawMeshes(VkCommandBuffer commands, const Stage& stage, PipelineKind kind) const {
  if (stage.parts.empty()) return;
  bind(commands, kind);
  vkCmdBindIndexBuffer(commands, data.meshIndices(), 0, VK_INDEX_TYPE_UINT32);
  for (std::uint32_t i = 0; i < stage.parts.size(); ++i) {
    const MeshPart& part = stage.parts[i];
    if (part.visible || kind == PipelineKind::kShadowMesh)
      vkCmdDrawIndexed(commands, part.indexCount, 1, part.firstIndex, 0, i);
  }
}

void Renderer::Parts::drawSolids(VkCommandBuffer commands, SolidClass which, PipelineKind kind) const {
  bind(commands, kind);
  vkCmdBindIndexBuffer(commands, data.solidIndices(), 0, VK_INDEX_TYPE_UINT32);
  for (std::size_t mesh = 0; mesh < kSolidMeshes; ++mesh) {
    const SolidRange& range = data.solidRanges()[static_cast<std::size_t>(which)][mesh];
    // A plane is the ground of what lies on it, and casts no shadow.
    const bool casts =
        static_cast<SolidMesh>(mesh) != SolidMesh::kPlane || kind != PipelineKind::kShadowSolid;
    if (range.count == 0 || !casts) continue;
    const IndexRange indices = data.solidIndexRange(static_cast<SolidMesh>(mesh));
    vkCmdDrawIndexed(commands, indices.count, range.count, indices.first, 0, range.first);
  }
}

Eigen::Matrix4f projectionOf(float left, float right, float up, float down, float near, float far) {
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Zero();
  matrix(0, 0) = 2 / (right - left);
  matrix(0, 2) = (right + left) / (right - left);
  matrix(1, 1) = -2 / (up - down);
  matrix(1, 2) = -(up + down) / (up - down);
  matrix(2, 2) = far / (near - far);
  matrix(2, 3) = near * far / (near - far);
  matrix(3, 2) = -1;
  return matrix;
}

}  // namespace clothstream::xr
