// SPDX-License-Identifier: MIT
#include "clients/xr/render/frame_commands.h"

#include <cstdint>

#include "clients/xr/render/handle.h"

namespace clothstream::xr {

FrameCommands::FrameCommands(const GraphicsDevice& device) : device_(device) {
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  pool.queueFamilyIndex = device.queueFamily;
  check(vkCreateCommandPool(device.device, &pool, nullptr, &pool_), "vkCreateCommandPool");
  VkCommandBufferAllocateInfo buffers{};
  buffers.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  buffers.commandPool = pool_;
  buffers.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  buffers.commandBufferCount = kFramesInFlight;
  check(vkAllocateCommandBuffers(device.device, &buffers, buffers_.data()), "vkAllocateCommandBuffers");
  VkFenceCreateInfo fence{};
  fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  fence.flags = VK_FENCE_CREATE_SIGNALED_BIT;
  for (VkFence& each : fences_) check(vkCreateFence(device.device, &fence, nullptr, &each), "vkCreateFence");
}

FrameCommands::~FrameCommands() {
  vkDeviceWaitIdle(device_.device);
  for (const VkFence fence : fences_) vkDestroyFence(device_.device, fence, nullptr);
  vkDestroyCommandPool(device_.device, pool_, nullptr);
}

VkCommandBuffer FrameCommands::begin() {
  current_ = (current_ + 1) % kFramesInFlight;
  finish();
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(vkBeginCommandBuffer(buffers_[current_], &info), "vkBeginCommandBuffer");
  return buffers_[current_];
}

void FrameCommands::submit(VkSemaphore available, VkSemaphore drawn) {
  check(vkEndCommandBuffer(buffers_[current_]), "vkEndCommandBuffer");
  check(vkResetFences(device_.device, 1, &fences_[current_]), "vkResetFences");
  VkSubmitInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1;
  info.pCommandBuffers = &buffers_[current_];
  constexpr VkPipelineStageFlags kWaits = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  info.pWaitDstStageMask = &kWaits;
  info.waitSemaphoreCount = available == VK_NULL_HANDLE ? 0 : 1;
  info.pWaitSemaphores = &available;
  info.signalSemaphoreCount = drawn == VK_NULL_HANDLE ? 0 : 1;
  info.pSignalSemaphores = &drawn;
  check(vkQueueSubmit(device_.queue, 1, &info, fences_[current_]), "vkQueueSubmit");
}

void FrameCommands::finish() {
  check(vkWaitForFences(device_.device, 1, &fences_[current_], VK_TRUE, UINT64_MAX), "vkWaitForFences");
}

}  // namespace clothstream::xr
