// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/eye_pictures.h"

#include <stdexcept>
#include <string>
#include <utility>

#include <png.h>
#include <spdlog/spdlog.h>

namespace clothstream::xr {
namespace {

bool isBgr(VkFormat format) {
  return format == VK_FORMAT_B8G8R8A8_SRGB || format == VK_FORMAT_B8G8R8A8_UNORM;
}

std::uint32_t readableMemory(VkPhysicalDevice physical, std::uint32_t allowed) {
  VkPhysicalDeviceMemoryProperties memory;
  vkGetPhysicalDeviceMemoryProperties(physical, &memory);
  constexpr VkMemoryPropertyFlags kWanted =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
    if ((allowed & (1U << i)) != 0 && (memory.memoryTypes[i].propertyFlags & kWanted) == kWanted) return i;
  throw std::runtime_error("The device has no memory from which eye pictures can be read");
}

void changeLayout(VkCommandBuffer commands, VkImage image, std::uint32_t layers, bool toTransfer) {
  VkImageMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  constexpr VkAccessFlags kWrites = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
                          kReads = VK_ACCESS_TRANSFER_READ_BIT;
  barrier.srcAccessMask = toTransfer ? kWrites : kReads;
  barrier.dstAccessMask = toTransfer ? kReads : kWrites;
  barrier.oldLayout =
      toTransfer ? VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL : VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  barrier.newLayout =
      toTransfer ? VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL : VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, layers};
  constexpr VkPipelineStageFlags kDraws = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                                 kCopies = VK_PIPELINE_STAGE_TRANSFER_BIT;
  vkCmdPipelineBarrier(commands, toTransfer ? kDraws : kCopies, toTransfer ? kCopies : kDraws, 0, 0, nullptr,
                       0, nullptr, 1, &barrier);
}

}  // namespace

EyePictures::EyePictures(const GraphicsDevice& device, const Swapchain::Shape& shape,
                         std::filesystem::path folder)
    : shape_(shape), folder_(std::move(folder)) {
  if (!std::filesystem::is_directory(folder_))
    throw std::runtime_error("--eye-pictures: " + folder_.string() + " is no folder; make it first");
  layerBytes_ = VkDeviceSize{4} * shape.size.width * shape.size.height;
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = layerBytes_ * shape.layers;
  info.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  check(vkCreateBuffer(device.device, &info, nullptr, &buffer), "vkCreateBuffer");
  buffer_ = {device.device, buffer, vkDestroyBuffer};
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device.device, buffer, &needs);
  VkMemoryAllocateInfo allocation{};
  allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocation.allocationSize = needs.size;
  allocation.memoryTypeIndex = readableMemory(device.physical, needs.memoryTypeBits);
  VkDeviceMemory memory = VK_NULL_HANDLE;
  check(vkAllocateMemory(device.device, &allocation, nullptr, &memory), "vkAllocateMemory");
  memory_ = {device.device, memory, vkFreeMemory};
  check(vkBindBufferMemory(device.device, buffer, memory, 0), "vkBindBufferMemory");
  void* mapped = nullptr;
  check(vkMapMemory(device.device, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
  mapped_ = static_cast<const std::uint8_t*>(mapped);
}

void EyePictures::record(VkCommandBuffer commands, VkImage image) {
  changeLayout(commands, image, shape_.layers, true);
  VkBufferImageCopy copy{};
  copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, shape_.layers};
  copy.imageExtent = {shape_.size.width, shape_.size.height, 1};
  vkCmdCopyImageToBuffer(commands, image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, buffer_.get(), 1, &copy);
  changeLayout(commands, image, shape_.layers, false);
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier,
                       0, nullptr, 0, nullptr);
}

void EyePictures::write(std::uint64_t number) const {
  for (std::uint32_t layer = 0; layer < shape_.layers; ++layer) {
    const std::filesystem::path file =
        folder_ / ((layer == 0 ? "left_" : "right_") + std::to_string(number) + ".png");
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = shape_.size.width;
    image.height = shape_.size.height;
    image.format = isBgr(shape_.format) ? PNG_FORMAT_BGRA : PNG_FORMAT_RGBA;
    // A reader that waits for the file sees only complete ones.
    const std::filesystem::path part = file.string() + ".part";
    if (png_image_write_to_file(&image, part.c_str(), 0, mapped_ + layer * layerBytes_, 0, nullptr) == 0) {
      spdlog::error("Cannot write {}: {}", file.string(), image.message);
      return;
    }
    std::error_code error;
    std::filesystem::rename(part, file, error);
    if (error) spdlog::error("Cannot write {}: {}", file.string(), error.message());
  }
}

}  // namespace clothstream::xr
