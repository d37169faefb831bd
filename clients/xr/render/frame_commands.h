// SPDX-License-Identifier: MIT
// Command buffers of the frames that are in flight.
#pragma once

#include <array>

#include "clients/xr/render/handle.h"
#include "clients/xr/render/renderer.h"

namespace clothstream::xr {

class FrameCommands {
 public:
  explicit FrameCommands(const GraphicsDevice& device);
  ~FrameCommands();
  FrameCommands(const FrameCommands&) = delete;
  FrameCommands& operator=(const FrameCommands&) = delete;

  // Waits until the frame kFramesInFlight frames ago is complete, and begins to record.
  VkCommandBuffer begin();
  // Ends recording and submits. Colours are written after `available`, and `drawn` is signalled at the end;
  // null is allowed.
  void submit(VkSemaphore available = VK_NULL_HANDLE, VkSemaphore drawn = VK_NULL_HANDLE);
  // Number of the frame among those in flight, 0 to kFramesInFlight - 1.
  std::size_t current() const { return current_; }
  // Waits for the frame that was submitted last.
  void finish();

 private:
  GraphicsDevice device_;
  Owned<VkCommandPool> pool_;
  std::array<VkCommandBuffer, kFramesInFlight> buffers_{};
  std::array<Owned<VkFence>, kFramesInFlight> fences_;
  std::size_t current_ = 0;
};

}  // namespace clothstream::xr
