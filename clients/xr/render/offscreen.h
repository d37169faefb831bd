// SPDX-License-Identifier: MIT
// A target in memory, whose pixels can be read, and files of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "clients/xr/render/images.h"
#include "clients/xr/render/renderer.h"

namespace clothstream::xr {

class Offscreen {
 public:
  // Colours are VK_FORMAT_R8G8B8A8_SRGB. `hasDepth`: a depth image of VK_FORMAT_D32_SFLOAT too.
  Offscreen(const GraphicsDevice& device, VkExtent2D size, std::uint32_t views, bool hasDepth = false);

  Target target() const { return {colour_.view(), depth_ ? depth_->view() : VK_NULL_HANDLE, size_}; }
  // Records a copy of what Renderer::record() has drawn.
  void recordRead(VkCommandBuffer commands) const;
  // Pixels of a view once the commands are complete: red, green, blue and alpha, rows from the top.
  std::span<const std::uint8_t> pixels(std::uint32_t view = 0) const;
  // Depth of each pixel of a view, 0 to 1. Requires `hasDepth`.
  std::span<const float> depths(std::uint32_t view = 0) const;
  VkExtent2D size() const { return size_; }

 private:
  VkExtent2D size_;
  std::uint32_t views_;
  Image colour_;
  std::optional<Image> depth_;
  Buffer pixels_, depths_;
};

// Writes pixels as above to a PNG file, without alpha unless `keepsAlpha`. The file appears when it is
// complete. Throws std::runtime_error that names the file.
void writePng(const std::filesystem::path& file, VkExtent2D size, std::span<const std::uint8_t> pixels,
              bool keepsAlpha = false);

}  // namespace clothstream::xr
