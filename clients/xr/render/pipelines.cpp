// SPDX-License-Identifier: MIT
#include "clients/xr/render/pipelines.h"

#include <span>

#include "clients/xr/shaders/floor_frag.h"
#include "clients/xr/shaders/floor_vert.h"
#include "clients/xr/shaders/gather_normals_comp.h"
#include "clients/xr/shaders/mesh_frag.h"
#include "clients/xr/shaders/mesh_vert.h"
#include "clients/xr/shaders/quad_frag.h"
#include "clients/xr/shaders/quad_vert.h"
#include "clients/xr/shaders/records.h"
#include "clients/xr/shaders/shadow_mesh_vert.h"
#include "clients/xr/shaders/shadow_solid_vert.h"
#include "clients/xr/shaders/sky_frag.h"
#include "clients/xr/shaders/sky_vert.h"
#include "clients/xr/shaders/solid_frag.h"
#include "clients/xr/shaders/solid_vert.h"

namespace clothstream::xr {
namespace {

using Words = std::span<const std::uint32_t>;

struct Design {
  Words vertex, fragment;
  bool isShadow = false;
  bool culls = false;  // triangles that show their back
  bool tests = true;   // depth
  bool writesDepth = true;
  VkCompareOp nearer = VK_COMPARE_OP_LESS;
};

// In the order of PipelineKind.
std::array<Design, kPipelineKinds> designs() {
  return {{
      {.vertex = shaders::shadow_mesh_vert, .fragment = {}, .isShadow = true},
      {.vertex = shaders::shadow_solid_vert, .fragment = {}, .isShadow = true},
      {.vertex = shaders::mesh_vert, .fragment = shaders::mesh_frag},
      {.vertex = shaders::solid_vert, .fragment = shaders::solid_frag, .culls = true},
      {.vertex = shaders::floor_vert, .fragment = shaders::floor_frag, .culls = true},
      {.vertex = shaders::sky_vert,
       .fragment = shaders::sky_frag,
       .writesDepth = false,
       .nearer = VK_COMPARE_OP_LESS_OR_EQUAL},
      {.vertex = shaders::quad_vert, .fragment = shaders::quad_frag},
  }};
}

Owned<VkShaderModule> module(VkDevice device, Words words) {
  VkShaderModuleCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  info.codeSize = words.size_bytes();
  info.pCode = words.data();
  VkShaderModule module = VK_NULL_HANDLE;
  check(vkCreateShaderModule(device, &info, nullptr, &module), "vkCreateShaderModule");
  return {device, module, vkDestroyShaderModule};
}

VkPipelineShaderStageCreateInfo stage(VkShaderStageFlagBits kind, VkShaderModule module,
                                      const VkSpecializationInfo* specialization) {
  VkPipelineShaderStageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage = kind;
  info.module = module;
  info.pName = "main";
  info.pSpecializationInfo = specialization;
  return info;
}

VkShaderStageFlags stagesOf(std::uint32_t binding) {
  switch (binding) {
    case shaders::kFrameBinding:
      return VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
    case shaders::kPositionsBinding:
    case shaders::kNormalsBinding:
      return VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_COMPUTE_BIT;
    case shaders::kFanStartsBinding:
    case shaders::kFansBinding:
      return VK_SHADER_STAGE_COMPUTE_BIT;
    case shaders::kVerticesBinding:
      return VK_SHADER_STAGE_VERTEX_BIT;
    default:
      return VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
  }
}

Owned<VkPipeline> graphicsPipeline(VkDevice device, const RendererOptions& options, const Passes& passes,
                                   VkPipelineLayout layout, VkPipelineCache cache, const Design& design) {
  // Constants of light.glsl.
  const std::array<std::uint32_t, 2> constants{options.shadows == ShadowDetail::kFull ? 1U : 0U,
                                               options.hasDensity ? 0U : 1U};
  constexpr std::array<VkSpecializationMapEntry, 2> kEntries{
      {{0, 0, sizeof(std::uint32_t)}, {1, sizeof(std::uint32_t), sizeof(std::uint32_t)}}};
  const VkSpecializationInfo specialization{kEntries.size(), kEntries.data(), sizeof(constants),
                                            constants.data()};
  const Owned<VkShaderModule> vertex = module(device, design.vertex);
  const Owned<VkShaderModule> fragment =
      design.isShadow ? Owned<VkShaderModule>() : module(device, design.fragment);
  const std::array stages{stage(VK_SHADER_STAGE_VERTEX_BIT, vertex.get(), nullptr),
                          stage(VK_SHADER_STAGE_FRAGMENT_BIT, fragment.get(), &specialization)};
  VkPipelineVertexInputStateCreateInfo input{};
  input.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
  VkPipelineInputAssemblyStateCreateInfo assembly{};
  assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  VkPipelineViewportStateCreateInfo viewport{};
  viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
  viewport.viewportCount = viewport.scissorCount = 1;
  VkPipelineRasterizationStateCreateInfo raster{};
  raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
  raster.cullMode = design.culls ? VK_CULL_MODE_BACK_BIT : VK_CULL_MODE_NONE;
  raster.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
  raster.lineWidth = 1;
  VkPipelineMultisampleStateCreateInfo multisample{};
  multisample.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
  multisample.rasterizationSamples = design.isShadow ? VK_SAMPLE_COUNT_1_BIT : options.samples;
  VkPipelineDepthStencilStateCreateInfo depth{};
  depth.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO;
  depth.depthTestEnable = design.tests ? VK_TRUE : VK_FALSE;
  depth.depthWriteEnable = design.writesDepth ? VK_TRUE : VK_FALSE;
  depth.depthCompareOp = design.nearer;
  // Colours are multiplied with alpha.
  VkPipelineColorBlendAttachmentState blend{};
  blend.blendEnable = VK_TRUE;
  blend.srcColorBlendFactor = blend.srcAlphaBlendFactor = VK_BLEND_FACTOR_ONE;
  blend.dstColorBlendFactor = blend.dstAlphaBlendFactor = VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
  blend.colorWriteMask = VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT |
                         VK_COLOR_COMPONENT_A_BIT;
  VkPipelineColorBlendStateCreateInfo blending{};
  blending.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
  blending.attachmentCount = design.isShadow ? 0 : 1;
  blending.pAttachments = &blend;
  const std::array dynamicStates{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  VkPipelineDynamicStateCreateInfo dynamic{};
  dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
  dynamic.dynamicStateCount = dynamicStates.size();
  dynamic.pDynamicStates = dynamicStates.data();
  VkGraphicsPipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
  info.stageCount = design.isShadow ? 1 : 2;
  info.pStages = stages.data();
  info.pVertexInputState = &input;
  info.pInputAssemblyState = &assembly;
  info.pViewportState = &viewport;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &multisample;
  info.pDepthStencilState = &depth;
  info.pColorBlendState = &blending;
  info.pDynamicState = &dynamic;
  info.layout = layout;
  info.renderPass = design.isShadow ? passes.shadow() : passes.picture(false);
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateGraphicsPipelines(device, cache, 1, &info, nullptr, &pipeline), "vkCreateGraphicsPipelines");
  return {device, pipeline, vkDestroyPipeline};
}

}  // namespace

VkDescriptorType descriptorType(std::uint32_t binding) {
  if (binding == shaders::kFrameBinding) return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
  return binding < shaders::kShadowDepthsBinding ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
                                                 : VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
}

Pipelines::Pipelines(const GraphicsDevice& device, const RendererOptions& options, const Passes& passes) {
  std::array<VkDescriptorSetLayoutBinding, shaders::kBindings> bindings{};
  for (std::uint32_t i = 0; i < shaders::kBindings; ++i)
    bindings[i] = {.binding = i,
                   .descriptorType = descriptorType(i),
                   .descriptorCount = 1,
                   .stageFlags = stagesOf(i),
                   .pImmutableSamplers = nullptr};
  VkDescriptorSetLayoutCreateInfo setInfo{};
  setInfo.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  setInfo.bindingCount = shaders::kBindings;
  setInfo.pBindings = bindings.data();
  VkDescriptorSetLayout set = VK_NULL_HANDLE;
  check(vkCreateDescriptorSetLayout(device.device, &setInfo, nullptr, &set), "vkCreateDescriptorSetLayout");
  setLayout_ = {device.device, set, vkDestroyDescriptorSetLayout};
  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(NodeRange)};
  VkPipelineLayoutCreateInfo layoutInfo{};
  layoutInfo.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layoutInfo.setLayoutCount = 1;
  layoutInfo.pSetLayouts = &set;
  layoutInfo.pushConstantRangeCount = 1;
  layoutInfo.pPushConstantRanges = &range;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  check(vkCreatePipelineLayout(device.device, &layoutInfo, nullptr, &layout), "vkCreatePipelineLayout");
  layout_ = {device.device, layout, vkDestroyPipelineLayout};
  VkPipelineCacheCreateInfo cacheInfo{};
  cacheInfo.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
  VkPipelineCache cache = VK_NULL_HANDLE;
  check(vkCreatePipelineCache(device.device, &cacheInfo, nullptr, &cache), "vkCreatePipelineCache");
  cache_ = {device.device, cache, vkDestroyPipelineCache};
  const std::array<Design, kPipelineKinds> all = designs();
  for (std::size_t i = 0; i < kPipelineKinds; ++i)
    graphics_[i] = graphicsPipeline(device.device, options, passes, layout, cache, all[i]);
  const Owned<VkShaderModule> compute = module(device.device, shaders::gather_normals_comp);
  VkComputePipelineCreateInfo computeInfo{};
  computeInfo.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  computeInfo.stage = stage(VK_SHADER_STAGE_COMPUTE_BIT, compute.get(), nullptr);
  computeInfo.layout = layout;
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateComputePipelines(device.device, cache, 1, &computeInfo, nullptr, &pipeline),
        "vkCreateComputePipelines");
  gatherNormals_ = {device.device, pipeline, vkDestroyPipeline};
}

}  // namespace clothstream::xr
