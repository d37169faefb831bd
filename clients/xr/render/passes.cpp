// SPDX-License-Identifier: MIT
#include "clients/xr/render/passes.h"

#include "clients/xr/render/light.h"

namespace clothstream::xr {
namespace {

constexpr VkPipelineStageFlags kDepthStages =
    VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
constexpr VkAccessFlags kDepthAccess =
    VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
constexpr VkAccessFlags kColourAccess =
    VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;

VkAttachmentDescription2 attachment(VkFormat format, VkSampleCountFlagBits samples, VkAttachmentLoadOp load,
                                    VkAttachmentStoreOp store, VkImageLayout finalLayout) {
  VkAttachmentDescription2 description{};
  description.sType = VK_STRUCTURE_TYPE_ATTACHMENT_DESCRIPTION_2;
  description.format = format;
  description.samples = samples;
  description.loadOp = load;
  description.storeOp = store;
  description.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
  description.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  description.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  description.finalLayout = finalLayout;
  return description;
}

VkAttachmentReference2 reference(std::uint32_t index, VkImageLayout layout, VkImageAspectFlags aspect) {
  VkAttachmentReference2 reference{};
  reference.sType = VK_STRUCTURE_TYPE_ATTACHMENT_REFERENCE_2;
  reference.attachment = index;
  reference.layout = layout;
  reference.aspectMask = aspect;
  return reference;
}

VkSubpassDependency2 dependency(std::uint32_t from, std::uint32_t to, VkPipelineStageFlags fromStages,
                                VkAccessFlags fromAccess, VkPipelineStageFlags toStages,
                                VkAccessFlags toAccess) {
  VkSubpassDependency2 dependency{};
  dependency.sType = VK_STRUCTURE_TYPE_SUBPASS_DEPENDENCY_2;
  dependency.srcSubpass = from;
  dependency.dstSubpass = to;
  dependency.srcStageMask = fromStages;
  dependency.dstStageMask = toStages;
  dependency.srcAccessMask = fromAccess;
  dependency.dstAccessMask = toAccess;
  return dependency;
}

Owned<VkRenderPass> renderPass(VkDevice device, const std::vector<VkAttachmentDescription2>& attachments,
                               const VkSubpassDescription2& subpass,
                               const std::vector<VkSubpassDependency2>& dependencies,
                               const VkRenderPassFragmentDensityMapCreateInfoEXT* density = nullptr) {
  VkRenderPassCreateInfo2 info{};
  info.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO_2;
  info.pNext = density;
  info.attachmentCount = static_cast<std::uint32_t>(attachments.size());
  info.pAttachments = attachments.data();
  info.subpassCount = 1;
  info.pSubpasses = &subpass;
  info.dependencyCount = static_cast<std::uint32_t>(dependencies.size());
  info.pDependencies = dependencies.data();
  if (subpass.viewMask != 0) {
    info.correlatedViewMaskCount = 1;
    info.pCorrelatedViewMasks = &subpass.viewMask;
  }
  VkRenderPass pass = VK_NULL_HANDLE;
  check(vkCreateRenderPass2(device, &info, nullptr, &pass), "vkCreateRenderPass2");
  return {device, pass, vkDestroyRenderPass};
}

Owned<VkFramebuffer> makeFramebuffer(VkDevice device, VkRenderPass pass,
                                     const std::vector<VkImageView>& views, VkExtent2D size) {
  VkFramebufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO;
  info.renderPass = pass;
  info.attachmentCount = static_cast<std::uint32_t>(views.size());
  info.pAttachments = views.data();
  info.width = size.width;
  info.height = size.height;
  info.layers = 1;
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  check(vkCreateFramebuffer(device, &info, nullptr, &framebuffer), "vkCreateFramebuffer");
  return {device, framebuffer, vkDestroyFramebuffer};
}

VkImageAspectFlags depthAspect(VkFormat format) {
  const bool hasStencil = format == VK_FORMAT_D24_UNORM_S8_UINT || format == VK_FORMAT_D32_SFLOAT_S8_UINT ||
                          format == VK_FORMAT_D16_UNORM_S8_UINT;
  return VK_IMAGE_ASPECT_DEPTH_BIT | (hasStencil ? VkImageAspectFlags{VK_IMAGE_ASPECT_STENCIL_BIT} : 0);
}

}  // namespace

Passes::Passes(const GraphicsDevice& device, const RendererOptions& options)
    : device_(device), options_(options) {
  makeShadowPass();
  makePicturePass(false);
  makePicturePass(true);
  depth_ = Image(
      device, {.format = options.depth,
               .size = options.largest,
               .layers = options.views,
               .samples = options.samples,
               .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSIENT_ATTACHMENT_BIT,
               .aspect = depthAspect(options.depth)});
  if (options.samples == VK_SAMPLE_COUNT_1_BIT) return;
  colour_ =
      Image(device, {.format = options.colour,
                     .size = options.largest,
                     .layers = options.views,
                     .samples = options.samples,
                     .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSIENT_ATTACHMENT_BIT});
}

void Passes::makeShadowPass() {
  constexpr VkFormat kFormat = VK_FORMAT_D32_SFLOAT;
  constexpr VkExtent2D kSize{kShadowTexels, kShadowTexels};
  shadowMap_ =
      Image(device_, {.format = kFormat,
                      .size = kSize,
                      .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_SAMPLED_BIT,
                      .aspect = VK_IMAGE_ASPECT_DEPTH_BIT,
                      .array = false});
  const VkAttachmentReference2 depth =
      reference(0, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL, VK_IMAGE_ASPECT_DEPTH_BIT);
  VkSubpassDescription2 subpass{};
  subpass.sType = VK_STRUCTURE_TYPE_SUBPASS_DESCRIPTION_2;
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.pDepthStencilAttachment = &depth;
  shadow_ =
      renderPass(device_.device,
                 {attachment(kFormat, VK_SAMPLE_COUNT_1_BIT, VK_ATTACHMENT_LOAD_OP_CLEAR,
                             VK_ATTACHMENT_STORE_OP_STORE, VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL)},
                 subpass,
                 // The frame before reads the map until its fragments are done.
                 {dependency(VK_SUBPASS_EXTERNAL, 0, VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT | kDepthStages,
                             VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT, kDepthStages, kDepthAccess),
                  dependency(0, VK_SUBPASS_EXTERNAL, VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT,
                             VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT,
                             VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT)});
  shadowFramebuffer_ = makeFramebuffer(device_.device, shadow_.get(), {shadowMap_.view()}, kSize);
}

void Passes::makePicturePass(bool givesDepth) {
  const bool resolves = options_.samples != VK_SAMPLE_COUNT_1_BIT;
  constexpr VkImageLayout kColour = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  constexpr VkImageLayout kDepth = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
  constexpr VkImageLayout kDensity = VK_IMAGE_LAYOUT_FRAGMENT_DENSITY_MAP_OPTIMAL_EXT;
  constexpr auto kKeep = VK_ATTACHMENT_STORE_OP_STORE, kDrop = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  const VkImageAspectFlags aspect = depthAspect(options_.depth);
  std::vector<VkAttachmentDescription2> attachments{
      attachment(options_.colour, options_.samples, VK_ATTACHMENT_LOAD_OP_CLEAR, resolves ? kDrop : kKeep,
                 kColour),
      attachment(options_.depth, options_.samples, VK_ATTACHMENT_LOAD_OP_CLEAR,
                 givesDepth && !resolves ? kKeep : kDrop, kDepth)};
  const VkAttachmentReference2 colour = reference(0, kColour, VK_IMAGE_ASPECT_COLOR_BIT);
  const VkAttachmentReference2 depth = reference(1, kDepth, aspect);
  const VkAttachmentReference2 resolvedColour = reference(2, kColour, VK_IMAGE_ASPECT_COLOR_BIT);
  const VkAttachmentReference2 resolvedDepth = reference(3, kDepth, aspect);
  VkSubpassDescriptionDepthStencilResolve depthResolve{};
  depthResolve.sType = VK_STRUCTURE_TYPE_SUBPASS_DESCRIPTION_DEPTH_STENCIL_RESOLVE;
  depthResolve.depthResolveMode = VK_RESOLVE_MODE_SAMPLE_ZERO_BIT;
  depthResolve.stencilResolveMode = VK_RESOLVE_MODE_NONE;
  depthResolve.pDepthStencilResolveAttachment = &resolvedDepth;
  VkSubpassDescription2 subpass{};
  subpass.sType = VK_STRUCTURE_TYPE_SUBPASS_DESCRIPTION_2;
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.viewMask = (1U << options_.views) - 1;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &colour;
  subpass.pDepthStencilAttachment = &depth;
  if (resolves) {
    attachments.push_back(
        attachment(options_.colour, VK_SAMPLE_COUNT_1_BIT, VK_ATTACHMENT_LOAD_OP_DONT_CARE, kKeep, kColour));
    subpass.pResolveAttachments = &resolvedColour;
    if (givesDepth) {
      attachments.push_back(
          attachment(options_.depth, VK_SAMPLE_COUNT_1_BIT, VK_ATTACHMENT_LOAD_OP_DONT_CARE, kKeep, kDepth));
      subpass.pNext = &depthResolve;
    }
  }
  VkRenderPassFragmentDensityMapCreateInfoEXT density{};
  density.sType = VK_STRUCTURE_TYPE_RENDER_PASS_FRAGMENT_DENSITY_MAP_CREATE_INFO_EXT;
  density.fragmentDensityMapAttachment = {static_cast<std::uint32_t>(attachments.size()), kDensity};
  if (options_.hasDensity) {
    VkAttachmentDescription2 map =
        attachment(VK_FORMAT_R8G8_UNORM, VK_SAMPLE_COUNT_1_BIT, VK_ATTACHMENT_LOAD_OP_LOAD, kDrop, kDensity);
    map.initialLayout = kDensity;
    attachments.push_back(map);
  }
  // Frames share the images with several samples, and use those of the target one after the other.
  constexpr VkPipelineStageFlags kStages = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT | kDepthStages;
  pictures_[givesDepth ? 1 : 0] = renderPass(
      device_.device, attachments, subpass,
      {dependency(VK_SUBPASS_EXTERNAL, 0, kStages,
                  VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT,
                  kStages, kColourAccess | kDepthAccess)},
      options_.hasDensity ? &density : nullptr);
}

VkFramebuffer Passes::framebuffer(const Target& target) {
  for (const Known& known : framebuffers_)
    if (known.colour == target.colour && known.depth == target.depth && known.density == target.density &&
        known.size.width == target.size.width && known.size.height == target.size.height)
      return known.framebuffer.get();
  const bool resolves = options_.samples != VK_SAMPLE_COUNT_1_BIT;
  const bool givesDepth = target.depth != VK_NULL_HANDLE;
  std::vector<VkImageView> views;
  if (resolves) {
    views = {colour_.view(), depth_.view(), target.colour};
    if (givesDepth) views.push_back(target.depth);
  } else {
    views = {target.colour, givesDepth ? target.depth : depth_.view()};
  }
  // The last attachment, as in the pass.
  if (options_.hasDensity) views.push_back(target.density);
  framebuffers_.push_back({target.colour, target.depth, target.density, target.size,
                           makeFramebuffer(device_.device, picture(givesDepth), views, target.size)});
  return framebuffers_.back().framebuffer.get();
}

}  // namespace clothstream::xr
