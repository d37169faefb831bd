// SPDX-License-Identifier: MIT
// Images of both eyes that a runtime shows: layers of one array, so that one pass draws them.
#pragma once

#include <span>
#include <vector>

#include "clients/xr/openxr/xr.h"

namespace clothstream::xr {

class Swapchain {
 public:
  struct Shape {
    VkFormat format = VK_FORMAT_UNDEFINED;
    VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT;
    XrSwapchainUsageFlags usage = 0;
    VkExtent2D size{};
    std::uint32_t layers = 2;
    bool hasDensity = false;  // each image has a density map of the runtime
  };
  Swapchain(XrSession session, VkDevice device, const Shape& shape);
  ~Swapchain();
  Swapchain(const Swapchain&) = delete;
  Swapchain& operator=(const Swapchain&) = delete;

  XrSwapchain get() const { return swapchain_; }
  const Shape& shape() const { return shape_; }

  // Takes the next image and waits until the runtime has finished reading it.
  void acquire();
  void release();
  // The acquired image, and a view of all its layers.
  VkImage image() const { return images_[index_]; }
  VkImageView view() const { return views_[index_]; }
  // Density map of the acquired image; null without one.
  VkImageView density() const { return densityViews_.empty() ? VK_NULL_HANDLE : densityViews_[index_]; }
  // Records the change of all density maps to the layout in which they are read. Their contents are
  // discarded: call it once, before foveate().
  void recordDensityLayout(VkCommandBuffer commands) const;

 private:
  void makeViews();
  void destroy();

  VkDevice device_;
  Shape shape_;
  XrSwapchain swapchain_ = XR_NULL_HANDLE;
  std::vector<VkImage> images_, densityImages_;
  std::vector<VkImageView> views_, densityViews_;
  std::uint32_t index_ = 0;
};

// First of the wanted formats that the runtime offers; VK_FORMAT_UNDEFINED without one.
VkFormat chooseFormat(XrSession session, std::span<const VkFormat> wanted);

}  // namespace clothstream::xr
