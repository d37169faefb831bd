// SPDX-License-Identifier: MIT
// Command buffers of the frames that are in flight.
#pragma once

#include <array>

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
  // Ends recording and submits.
  void submit();
  // Waits for the frame that was submitted last.
  void finish();

 private:
  GraphicsDevice device_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  std::array<VkCommandBuffer, kFramesInFlight> buffers_{};
  std::array<VkFence, kFramesInFlight> fences_{};
  std::size_t current_ = 0;
};

}  // namespace clothstream::xr
