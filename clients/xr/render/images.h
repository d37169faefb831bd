// SPDX-License-Identifier: MIT
// Images with their memory and a view, and how texels get into them.
#pragma once

#include <cstdint>
#include <span>

#include "clients/xr/render/buffers.h"

namespace clothstream::xr {

struct ImageOptions {
  VkFormat format = VK_FORMAT_R8G8B8A8_UNORM;
  VkExtent2D size{};
  std::uint32_t layers = 1, levels = 1;
  VkSampleCountFlagBits samples = VK_SAMPLE_COUNT_1_BIT;
  VkImageUsageFlags usage = 0;
  VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT;
  bool array = true;  // the view is one of an array, also with one layer
};

// A 2D image with its own memory and a view of all of it.
class Image {
 public:
  Image() = default;
  Image(const GraphicsDevice& device, const ImageOptions& options);

  VkImage get() const { return image_.get(); }
  VkImageView view() const { return view_.get(); }
  const ImageOptions& options() const { return options_; }

 private:
  ImageOptions options_;
  Owned<VkDeviceMemory> memory_;  // outlives the image
  Owned<VkImage> image_;
  Owned<VkImageView> view_;
};

// Number of levels down to one texel.
std::uint32_t levelsOf(VkExtent2D size);

// Records a change of layout for all levels of some layers, which waits for `from` and holds up `to`.
struct Access {
  VkPipelineStageFlags stages = 0;
  VkAccessFlags access = 0;
  VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
};
void changeLayout(VkCommandBuffer commands, const Image& image, std::uint32_t firstLayer,
                  std::uint32_t layers, const Access& from, const Access& to);

// How shaders of fragments read an image.
inline constexpr Access kSampled{VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT,
                                 VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};

// Copy of texels, whose rows follow each other in a buffer, into a rectangle of a layer.
VkBufferImageCopy copyInto(const Image& image, std::uint32_t layer, VkOffset2D at, VkExtent2D size,
                           VkDeviceSize offset);

// Records copies into a layer, and makes its smaller levels. The layer was sampled or undefined before, and
// is sampled afterwards.
void recordTexels(VkCommandBuffer commands, const Image& image, std::uint32_t layer,
                  std::span<const VkBufferImageCopy> copies, VkBuffer from, bool wasUndefined);
// Likewise for one copy into the upper left part.
void recordTexels(VkCommandBuffer commands, const Image& image, std::uint32_t layer, VkExtent2D size,
                  VkBuffer from, VkDeviceSize offset, bool wasUndefined);

}  // namespace clothstream::xr
