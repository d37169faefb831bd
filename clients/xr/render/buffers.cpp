// SPDX-License-Identifier: MIT
#include "clients/xr/render/buffers.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace clothstream::xr {

void check(VkResult result, const char* call) {
  if (result >= VK_SUCCESS) return;
  const char* meaning = result == VK_ERROR_OUT_OF_DEVICE_MEMORY ? " (the graphics device has no memory left)"
                        : result == VK_ERROR_OUT_OF_HOST_MEMORY ? " (no memory left)"
                        : result == VK_ERROR_DEVICE_LOST        ? " (the graphics device is lost)"
                                                                : "";
  throw std::runtime_error(fmt::format("{} failed with {}{}", call, static_cast<int>(result), meaning));
}

Owned<VkDeviceMemory> allocateMemory(const GraphicsDevice& device, const VkMemoryRequirements& needs,
                                     std::initializer_list<VkMemoryPropertyFlags> wanted) {
  VkPhysicalDeviceMemoryProperties properties{};
  vkGetPhysicalDeviceMemoryProperties(device.physical, &properties);
  // Memory of the device that the program can write is often scarce.
  VkResult result = VK_ERROR_FEATURE_NOT_PRESENT;
  for (const VkMemoryPropertyFlags flags : wanted)
    for (std::uint32_t i = 0; i < properties.memoryTypeCount; ++i) {
      if ((needs.memoryTypeBits & (1U << i)) == 0 ||
          (properties.memoryTypes[i].propertyFlags & flags) != flags)
        continue;
      VkMemoryAllocateInfo allocation{};
      allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
      allocation.allocationSize = needs.size;
      allocation.memoryTypeIndex = i;
      VkDeviceMemory memory = VK_NULL_HANDLE;
      result = vkAllocateMemory(device.device, &allocation, nullptr, &memory);
      if (result == VK_SUCCESS) return {device.device, memory, vkFreeMemory};
      if (result != VK_ERROR_OUT_OF_DEVICE_MEMORY) check(result, "vkAllocateMemory");
    }
  if (result == VK_ERROR_FEATURE_NOT_PRESENT)
    throw std::runtime_error("the graphics device has no memory of the kind that the renderer needs");
  throw std::runtime_error(
      fmt::format("the graphics device has no {} bytes of memory left for the scene", needs.size));
}

Buffer::Buffer(const GraphicsDevice& device, VkDeviceSize bytes, VkBufferUsageFlags usage,
               BufferAccess access)
    : bytes_(bytes) {
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = bytes;
  info.usage = usage;
  VkBuffer buffer = VK_NULL_HANDLE;
  check(vkCreateBuffer(device.device, &info, nullptr, &buffer), "vkCreateBuffer");
  buffer_ = {device.device, buffer, vkDestroyBuffer};
  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(device.device, buffer, &needs);
  constexpr VkMemoryPropertyFlags kMapped =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  constexpr VkMemoryPropertyFlags kOfDevice = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  switch (access) {
    case BufferAccess::kNone:
      memory_ = allocateMemory(device, needs, {kOfDevice, 0});
      break;
    case BufferAccess::kWritten:
      memory_ = allocateMemory(device, needs, {kMapped | kOfDevice, kMapped});
      break;
    case BufferAccess::kRead:  // reads of memory without a cache are many times slower
      memory_ = allocateMemory(device, needs, {kMapped | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, kMapped});
      break;
  }
  check(vkBindBufferMemory(device.device, buffer, memory_.get(), 0), "vkBindBufferMemory");
  if (access != BufferAccess::kNone)
    check(vkMapMemory(device.device, memory_.get(), 0, VK_WHOLE_SIZE, 0, &data_), "vkMapMemory");
}

void runNow(const GraphicsDevice& device, const std::function<void(VkCommandBuffer)>& record) {
  VkCommandPoolCreateInfo poolInfo{};
  poolInfo.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  poolInfo.queueFamilyIndex = device.queueFamily;
  VkCommandPool pool = VK_NULL_HANDLE;
  check(vkCreateCommandPool(device.device, &poolInfo, nullptr, &pool), "vkCreateCommandPool");
  const Owned<VkCommandPool> owned(device.device, pool, vkDestroyCommandPool);
  VkCommandBufferAllocateInfo allocation{};
  allocation.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  allocation.commandPool = pool;
  allocation.commandBufferCount = 1;
  VkCommandBuffer commands = VK_NULL_HANDLE;
  check(vkAllocateCommandBuffers(device.device, &allocation, &commands), "vkAllocateCommandBuffers");
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
  record(commands);
  check(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
  VkSubmitInfo submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands;
  check(vkQueueSubmit(device.queue, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
  check(vkQueueWaitIdle(device.queue), "vkQueueWaitIdle");
}

Buffer deviceBuffer(const GraphicsDevice& device, const void* data, VkDeviceSize bytes,
                    VkBufferUsageFlags usage) {
  Buffer buffer(device, std::max<VkDeviceSize>(bytes, 16), usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                BufferAccess::kNone);
  if (bytes == 0) return buffer;
  const Buffer staging(device, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, BufferAccess::kWritten);
  std::memcpy(staging.data(), data, bytes);
  runNow(device, [&](VkCommandBuffer commands) {
    const VkBufferCopy copy{0, 0, bytes};
    vkCmdCopyBuffer(commands, staging.get(), buffer.get(), 1, &copy);
    // Later submissions read the copy as vertices, indices and storage.
    VkMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_INDEX_READ_BIT;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT,
                         VK_PIPELINE_STAGE_VERTEX_INPUT_BIT | VK_PIPELINE_STAGE_VERTEX_SHADER_BIT |
                             VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                         0, 1, &barrier, 0, nullptr, 0, nullptr);
  });
  return buffer;
}

}  // namespace clothstream::xr
