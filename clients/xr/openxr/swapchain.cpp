// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/swapchain.h"

#include <algorithm>
#include <cstdint>

namespace clothstream::xr {

Swapchain::Swapchain(XrSession session, VkDevice device, const Shape& shape)
    : device_(device), shape_(shape) {
  auto info = typed<XrSwapchainCreateInfo>(XR_TYPE_SWAPCHAIN_CREATE_INFO);
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
    std::uint32_t count = 0;
    check(xrEnumerateSwapchainImages(swapchain_, 0, &count, nullptr), "xrEnumerateSwapchainImages");
    std::vector<XrSwapchainImageVulkan2KHR> images(
        count, typed<XrSwapchainImageVulkan2KHR>(XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR));
    check(xrEnumerateSwapchainImages(swapchain_, count, &count,
                                     reinterpret_cast<XrSwapchainImageBaseHeader*>(images.data())),
          "xrEnumerateSwapchainImages");
    for (const XrSwapchainImageVulkan2KHR& each : images) {
      VkImageViewCreateInfo view{};
      view.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
      view.image = each.image;
      view.viewType = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
      view.format = shape.format;
      view.subresourceRange = {shape.aspect, 0, 1, 0, shape.layers};
      VkImageView made = VK_NULL_HANDLE;
      check(vkCreateImageView(device, &view, nullptr, &made), "vkCreateImageView");
      images_.push_back(each.image);
      views_.push_back(made);
    }
  } catch (...) {
    for (const VkImageView view : views_) vkDestroyImageView(device_, view, nullptr);
    xrDestroySwapchain(swapchain_);
    throw;
  }
}

Swapchain::~Swapchain() {
  for (const VkImageView view : views_) vkDestroyImageView(device_, view, nullptr);
  xrDestroySwapchain(swapchain_);
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
