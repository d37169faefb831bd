// SPDX-License-Identifier: MIT
#include "clients/xr/render/frame_commands.h"

#include <cstdint>

namespace clothstream::xr {

FrameCommands::FrameCommands(const GraphicsDevice& device) : device_(device) {
  VkCommandPoolCreateInfo poolInfo{};
  poolInfo.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  poolInfo.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  poolInfo.queueFamilyIndex = device.queueFamily;
  VkCommandPool pool = VK_NULL_HANDLE;
  check(vkCreateCommandPool(device.device, &poolInfo, nullptr, &pool), "vkCreateCommandPool");
  pool_ = {device.device, pool, vkDestroyCommandPool};
  VkCommandBufferAllocateInfo buffers{};
  buffers.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  buffers.commandPool = pool;
  buffers.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  buffers.commandBufferCount = kFramesInFlight;
  check(vkAllocateCommandBuffers(device.device, &buffers, buffers_.data()), "vkAllocateCommandBuffers");
  VkFenceCreateInfo fenceInfo{};
  fenceInfo.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  fenceInfo.flags = VK_FENCE_CREATE_SIGNALED_BIT;
  for (Owned<VkFence>& each : fences_) {
    VkFence fence = VK_NULL_HANDLE;
    check(vkCreateFence(device.device, &fenceInfo, nullptr, &fence), "vkCreateFence");
    each = {device.device, fence, vkDestroyFence};
  }
}

FrameCommands::~FrameCommands() {
  vkDeviceWaitIdle(device_.device);
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
  const VkFence fence = fences_[current_].get();
  check(vkResetFences(device_.device, 1, &fence), "vkResetFences");
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
  check(vkQueueSubmit(device_.queue, 1, &info, fence), "vkQueueSubmit");
}

void FrameCommands::finish() {
  const VkFence fence = fences_[current_].get();
  check(vkWaitForFences(device_.device, 1, &fence, VK_TRUE, UINT64_MAX), "vkWaitForFences");
}

}  // namespace clothstream::xr
