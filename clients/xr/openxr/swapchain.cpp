// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/swapchain.h"

#include <algorithm>
#include <cstdint>

namespace clothstream::xr {
namespace {

VkImageView viewOf(VkDevice device, VkImage image, VkFormat format, VkImageAspectFlags aspect,
                   std::uint32_t layers) {
  VkImageViewCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
  info.image = image;
  info.viewType = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
  info.format = format;
  info.subresourceRange = {aspect, 0, 1, 0, layers};
  VkImageView view = VK_NULL_HANDLE;
  check(vkCreateImageView(device, &info, nullptr, &view), "vkCreateImageView");
  return view;
}

}  // namespace

Swapchain::Swapchain(XrSession session, VkDevice device, const Shape& shape)
    : device_(device), shape_(shape) {
  auto density = typed<XrSwapchainCreateInfoFoveationFB>(XR_TYPE_SWAPCHAIN_CREATE_INFO_FOVEATION_FB);
  density.flags = XR_SWAPCHAIN_CREATE_FOVEATION_FRAGMENT_DENSITY_MAP_BIT_FB;
  auto info = typed<XrSwapchainCreateInfo>(XR_TYPE_SWAPCHAIN_CREATE_INFO);
  if (shape.hasDensity) info.next = &density;
  info.usageFlags = shape.usage;
  info.format = shape.format;
  info.sampleCount = 1;
  info.width = shape.size.width;
  info.height = shape.size.height;
  info.faceCount = 1;
  info.arraySize = shape.layers;
  info.mipCount = 1;
  check(xrCreateSwapchain(session, &info, &swapchain_), "xrCreateSwapchain");
  try {
    makeViews();
  } catch (...) {
    destroy();
    throw;
  }
}

Swapchain::~Swapchain() {
  destroy();
}

void Swapchain::destroy() {
  for (const VkImageView view : views_) vkDestroyImageView(device_, view, nullptr);
  for (const VkImageView view : densityViews_) vkDestroyImageView(device_, view, nullptr);
  xrDestroySwapchain(swapchain_);
}

void Swapchain::makeViews() {
  std::uint32_t count = 0;
  check(xrEnumerateSwapchainImages(swapchain_, 0, &count, nullptr), "xrEnumerateSwapchainImages");
  std::vector<XrSwapchainImageVulkan2KHR> images(
      count, typed<XrSwapchainImageVulkan2KHR>(XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR));
  std::vector<XrSwapchainImageFoveationVulkanFB> densities(
      count, typed<XrSwapchainImageFoveationVulkanFB>(XR_TYPE_SWAPCHAIN_IMAGE_FOVEATION_VULKAN_FB));
  if (shape_.hasDensity)
    for (std::size_t i = 0; i < count; ++i) images[i].next = &densities[i];
  check(xrEnumerateSwapchainImages(swapchain_, count, &count,
                                   reinterpret_cast<XrSwapchainImageBaseHeader*>(images.data())),
        "xrEnumerateSwapchainImages");
  for (const XrSwapchainImageVulkan2KHR& each : images) {
    views_.push_back(viewOf(device_, each.image, shape_.format, shape_.aspect, shape_.layers));
    images_.push_back(each.image);
  }
  if (!shape_.hasDensity) return;
  for (const XrSwapchainImageFoveationVulkanFB& each : densities) {
    if (each.image == VK_NULL_HANDLE)
      throw XrError(XR_ERROR_RUNTIME_FAILURE, "The runtime gives no density map for an image");
    // A map with one layer is that of both eyes.
    densityViews_.push_back(viewOf(device_, each.image, VK_FORMAT_R8G8_UNORM, VK_IMAGE_ASPECT_COLOR_BIT,
                                   VK_REMAINING_ARRAY_LAYERS));
    densityImages_.push_back(each.image);
  }
}

void Swapchain::recordDensityLayout(VkCommandBuffer commands) const {
  for (const VkImage image : densityImages_) {
    VkImageMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
    barrier.dstAccessMask = VK_ACCESS_FRAGMENT_DENSITY_MAP_READ_BIT_EXT;
    barrier.oldLayout = VK_IMAGE_LAYOUT_UNDEFINED;
    barrier.newLayout = VK_IMAGE_LAYOUT_FRAGMENT_DENSITY_MAP_OPTIMAL_EXT;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, VK_REMAINING_ARRAY_LAYERS};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT,
                         VK_PIPELINE_STAGE_FRAGMENT_DENSITY_PROCESS_BIT_EXT, 0, 0, nullptr, 0, nullptr, 1,
                         &barrier);
  }
}

void Swapchain::acquire() {
  const auto acquire = typed<XrSwapchainImageAcquireInfo>(XR_TYPE_SWAPCHAIN_IMAGE_ACQUIRE_INFO);
  check(xrAcquireSwapchainImage(swapchain_, &acquire, &index_), "xrAcquireSwapchainImage");
  auto wait = typed<XrSwapchainImageWaitInfo>(XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO);
  wait.timeout = XR_INFINITE_DURATION;
  check(xrWaitSwapchainImage(swapchain_, &wait), "xrWaitSwapchainImage");
}

void Swapchain::release() {
  const auto info = typed<XrSwapchainImageReleaseInfo>(XR_TYPE_SWAPCHAIN_IMAGE_RELEASE_INFO);
  check(xrReleaseSwapchainImage(swapchain_, &info), "xrReleaseSwapchainImage");
}

VkFormat chooseFormat(XrSession session, std::span<const VkFormat> wanted) {
  std::uint32_t count = 0;
  check(xrEnumerateSwapchainFormats(session, 0, &count, nullptr), "xrEnumerateSwapchainFormats");
  std::vector<std::int64_t> offered(count);
  check(xrEnumerateSwapchainFormats(session, count, &count, offered.data()), "xrEnumerateSwapchainFormats");
  for (const VkFormat format : wanted)
    if (std::ranges::find(offered, static_cast<std::int64_t>(format)) != offered.end()) return format;
  return VK_FORMAT_UNDEFINED;
}

}  // namespace clothstream::xr
