// SPDX-License-Identifier: MIT
#include "clients/xr/render/images.h"

#include <algorithm>
#include <bit>

namespace clothstream::xr {
namespace {

void barrier(VkCommandBuffer commands, const Image& image, VkImageSubresourceRange range, const Access& from,
             const Access& to) {
  VkImageMemoryBarrier change{};
  change.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  change.srcAccessMask = from.access;
  change.dstAccessMask = to.access;
  change.oldLayout = from.layout;
  change.newLayout = to.layout;
  change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  change.image = image.get();
  change.subresourceRange = range;
  vkCmdPipelineBarrier(commands, from.stages, to.stages, 0, 0, nullptr, 0, nullptr, 1, &change);
}

constexpr Access kCopiedTo{VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                           VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL};
constexpr Access kCopiedFrom{VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT,
                             VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};

std::int32_t side(std::uint32_t texels, std::uint32_t level) {
  return static_cast<std::int32_t>(std::max(1U, texels >> level));
}

}  // namespace

Image::Image(const GraphicsDevice& device, const ImageOptions& options) : options_(options) {
  VkImageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = options.format;
  info.extent = {options.size.width, options.size.height, 1};
  info.mipLevels = options.levels;
  info.arrayLayers = options.layers;
  info.samples = options.samples;
  info.usage = options.usage;
  VkImage image = VK_NULL_HANDLE;
  check(vkCreateImage(device.device, &info, nullptr, &image), "vkCreateImage");
  image_ = {device.device, image, vkDestroyImage};
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(device.device, image, &needs);
  const bool isTransient = (options.usage & VK_IMAGE_USAGE_TRANSIENT_ATTACHMENT_BIT) != 0;
  constexpr VkMemoryPropertyFlags kOfDevice = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  // Tiled devices keep transient attachments out of memory.
  const VkMemoryPropertyFlags best =
      isTransient ? kOfDevice | VK_MEMORY_PROPERTY_LAZILY_ALLOCATED_BIT : kOfDevice;
  memory_ = allocateMemory(device, needs, {best, kOfDevice, 0});
  check(vkBindImageMemory(device.device, image, memory_.get(), 0), "vkBindImageMemory");
  VkImageViewCreateInfo viewInfo{};
  viewInfo.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
  viewInfo.image = image;
  viewInfo.viewType = options.array ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
  viewInfo.format = options.format;
  viewInfo.subresourceRange = {options.aspect, 0, options.levels, 0, options.layers};
  VkImageView view = VK_NULL_HANDLE;
  check(vkCreateImageView(device.device, &viewInfo, nullptr, &view), "vkCreateImageView");
  view_ = {device.device, view, vkDestroyImageView};
}

std::uint32_t levelsOf(VkExtent2D size) {
  return static_cast<std::uint32_t>(std::bit_width(std::max(size.width, size.height)));
}

void changeLayout(VkCommandBuffer commands, const Image& image, std::uint32_t firstLayer,
                  std::uint32_t layers, const Access& from, const Access& to) {
  const ImageOptions& options = image.options();
  barrier(commands, image, {options.aspect, 0, options.levels, firstLayer, layers}, from, to);
}

VkBufferImageCopy copyInto(const Image& image, std::uint32_t layer, VkOffset2D at, VkExtent2D size,
                           VkDeviceSize offset) {
  VkBufferImageCopy copy{};
  copy.bufferOffset = offset;
  copy.imageSubresource = {image.options().aspect, 0, layer, 1};
  copy.imageOffset = {at.x, at.y, 0};
  copy.imageExtent = {size.width, size.height, 1};
  return copy;
}

void recordTexels(VkCommandBuffer commands, const Image& image, std::uint32_t layer, VkExtent2D size,
                  VkBuffer from, VkDeviceSize offset, bool wasUndefined) {
  const VkBufferImageCopy copy = copyInto(image, layer, {0, 0}, size, offset);
  recordTexels(commands, image, layer, {&copy, 1}, from, wasUndefined);
}

void recordTexels(VkCommandBuffer commands, const Image& image, std::uint32_t layer,
                  std::span<const VkBufferImageCopy> copies, VkBuffer from, bool wasUndefined) {
  const ImageOptions& options = image.options();
  const Access before = wasUndefined ? Access{VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0, VK_IMAGE_LAYOUT_UNDEFINED}
                                     : Access{VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT, 0, kSampled.layout};
  changeLayout(commands, image, layer, 1, before, kCopiedTo);
  vkCmdCopyBufferToImage(commands, from, image.get(), kCopiedTo.layout,
                         static_cast<std::uint32_t>(copies.size()), copies.data());
  for (std::uint32_t level = 1; level < options.levels; ++level) {
    const VkImageSubresourceRange larger{options.aspect, level - 1, 1, layer, 1};
    barrier(commands, image, larger, kCopiedTo, kCopiedFrom);
    VkImageBlit blit{};
    blit.srcSubresource = {options.aspect, level - 1, layer, 1};
    blit.dstSubresource = {options.aspect, level, layer, 1};
    blit.srcOffsets[1] = {side(options.size.width, level - 1), side(options.size.height, level - 1), 1};
    blit.dstOffsets[1] = {side(options.size.width, level), side(options.size.height, level), 1};
    vkCmdBlitImage(commands, image.get(), kCopiedFrom.layout, image.get(), kCopiedTo.layout, 1, &blit,
                   VK_FILTER_LINEAR);
    barrier(commands, image, larger, kCopiedFrom, kSampled);
  }
  barrier(commands, image, {options.aspect, options.levels - 1, 1, layer, 1}, kCopiedTo, kSampled);
}

}  // namespace clothstream::xr
