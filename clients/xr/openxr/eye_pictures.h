// SPDX-License-Identifier: MIT
// Writes what both eyes see to PNG files.
#pragma once

#include <cstdint>
#include <filesystem>

#include "clients/xr/openxr/swapchain.h"
#include "clients/xr/render/handle.h"

namespace clothstream::xr {

class EyePictures {
 public:
  // Writes to an existing folder. `shape` is that of the swapchain, whose images can be read by transfers.
  EyePictures(const GraphicsDevice& device, const Swapchain::Shape& shape, std::filesystem::path folder);

  // Records a copy of all layers. The image is in VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL before and
  // afterwards.
  void record(VkCommandBuffer commands, VkImage image);
  // Writes left_N.png and right_N.png once the commands have been executed. A failure is logged.
  void write(std::uint64_t number) const;

 private:
  Swapchain::Shape shape_;
  std::filesystem::path folder_;
  VkDeviceSize layerBytes_ = 0;
  Owned<VkDeviceMemory> memory_;  // outlives the buffer
  Owned<VkBuffer> buffer_;
  const std::uint8_t* mapped_ = nullptr;
};

}  // namespace clothstream::xr
