// SPDX-License-Identifier: MIT
#include "clients/xr/render/offscreen.h"

#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <png.h>

namespace clothstream::xr {
namespace {

constexpr Access kCopied{VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_READ_BIT,
                         VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};
constexpr Access kColourWritten{VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
                                VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
                                VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
// A resolve of depth writes in the stage of colours.
constexpr Access kDepthWritten{
    VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
    VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
    VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};

void read(VkCommandBuffer commands, const Image& image, const Access& written, const Buffer& out) {
  const ImageOptions& options = image.options();
  changeLayout(commands, image, 0, options.layers, written, kCopied);
  VkBufferImageCopy copy{};
  copy.imageSubresource = {options.aspect, 0, 0, options.layers};
  copy.imageExtent = {options.size.width, options.size.height, 1};
  vkCmdCopyImageToBuffer(commands, image.get(), kCopied.layout, out.get(), 1, &copy);
}

}  // namespace

Offscreen::Offscreen(const GraphicsDevice& device, VkExtent2D size, std::uint32_t views, bool hasDepth)
    : size_(size),
      views_(views),
      colour_(device, {.format = VK_FORMAT_R8G8B8A8_SRGB,
                       .size = size,
                       .layers = views,
                       .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT}),
      pixels_(device, VkDeviceSize{4} * size.width * size.height * views, VK_BUFFER_USAGE_TRANSFER_DST_BIT,
              BufferAccess::kRead) {
  if (!hasDepth) return;
  depth_.emplace(device, ImageOptions{.format = VK_FORMAT_D32_SFLOAT,
                                      .size = size,
                                      .layers = views,
                                      .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT |
                                               VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                                      .aspect = VK_IMAGE_ASPECT_DEPTH_BIT});
  depths_ = Buffer(device, VkDeviceSize{4} * size.width * size.height * views,
                   VK_BUFFER_USAGE_TRANSFER_DST_BIT, BufferAccess::kRead);
}

void Offscreen::recordRead(VkCommandBuffer commands) const {
  read(commands, colour_, kColourWritten, pixels_);
  if (depth_) read(commands, *depth_, kDepthWritten, depths_);
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier,
                       0, nullptr, 0, nullptr);
}

std::span<const std::uint8_t> Offscreen::pixels(std::uint32_t view) const {
  const std::size_t bytes = std::size_t{4} * size_.width * size_.height;
  return {static_cast<const std::uint8_t*>(pixels_.data()) + bytes * view, bytes};
}

std::span<const float> Offscreen::depths(std::uint32_t view) const {
  const std::size_t count = std::size_t{size_.width} * size_.height;
  return {static_cast<const float*>(depths_.data()) + count * view, count};
}

void writePng(const std::filesystem::path& file, VkExtent2D size, std::span<const std::uint8_t> pixels,
              bool keepsAlpha) {
  std::vector<std::uint8_t> opaque;
  const std::uint8_t* data = pixels.data();
  if (!keepsAlpha) {
    opaque.reserve(std::size_t{3} * size.width * size.height);
    for (std::size_t i = 0; i + 3 < pixels.size(); i += 4)
      opaque.insert(opaque.end(), &pixels[i], &pixels[i] + 3);
    data = opaque.data();
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = size.width;
  image.height = size.height;
  image.format = keepsAlpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  const std::filesystem::path part = file.string() + ".part";
  if (png_image_write_to_file(&image, part.c_str(), 0, data, 0, nullptr) == 0)
    throw std::runtime_error(fmt::format("{} cannot be written: {}", file.string(), image.message));
  std::error_code error;
  std::filesystem::rename(part, file, error);
  if (error)
    throw std::runtime_error(fmt::format("{} cannot be written: {}", file.string(), error.message()));
}

}  // namespace clothstream::xr
