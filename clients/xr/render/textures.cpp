// SPDX-License-Identifier: MIT
#include "clients/xr/render/textures.h"

#include <algorithm>
#include <cstring>
#include <future>
#include <span>

#include "clients/xr/render/weave.h"

namespace clothstream::xr {
namespace {

constexpr std::uint32_t kWeaveTexels = 400;
constexpr VkExtent2D kLabelSize{640, 72};  // as TextPainter::label() makes them at most
constexpr VkDeviceSize kPanelBytes = VkDeviceSize{4} * kPanelTexels[0] * kPanelTexels[1];
constexpr VkDeviceSize kLabelBytes = VkDeviceSize{4} * kLabelSize.width * kLabelSize.height;
constexpr std::uint32_t kLabelsPerFrame = 4;
constexpr VkImageUsageFlags kUsage =
    VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;

Owned<VkSampler> sampler(VkDevice device, VkSamplerCreateInfo info) {
  info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
  VkSampler sampler = VK_NULL_HANDLE;
  check(vkCreateSampler(device, &info, nullptr, &sampler), "vkCreateSampler");
  return {device, sampler, vkDestroySampler};
}

bool filtersDepth(const GraphicsDevice& device) {
  VkFormatProperties properties{};
  vkGetPhysicalDeviceFormatProperties(device.physical, VK_FORMAT_D32_SFLOAT, &properties);
  return (properties.optimalTilingFeatures & VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT) != 0;
}

}  // namespace

Textures::Textures(const GraphicsDevice& device) {
  panelCopies_.reserve(kPanelTexels[1] / kChangeRows);
  makeSamplers(device);
  constexpr VkExtent2D kPanelSize{kPanelTexels[0], kPanelTexels[1]};
  panel_ =
      Image(device, {.size = kPanelSize, .levels = levelsOf(kPanelSize), .usage = kUsage, .array = false});
  labels_ = Image(device, {.size = kLabelSize, .layers = kLabelLayers, .levels = 4, .usage = kUsage});
  const Buffer nothing(device, kPanelBytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, BufferAccess::kWritten);
  std::memset(nothing.data(), 0, kPanelBytes);
  runNow(device, [&](VkCommandBuffer commands) {
    recordTexels(commands, panel_, 0, kPanelSize, nothing.get(), 0, true);
    for (std::uint32_t layer = 0; layer < kLabelLayers; ++layer)
      recordTexels(commands, labels_, layer, kLabelSize, nothing.get(), 0, true);
  });
  makeWeaves(device);
}

void Textures::makeSamplers(const GraphicsDevice& device) {
  VkPhysicalDeviceFeatures features{};
  vkGetPhysicalDeviceFeatures(device.physical, &features);  // DeviceRequest turns anisotropy on where it is
  VkPhysicalDeviceProperties properties{};
  vkGetPhysicalDeviceProperties(device.physical, &properties);
  // Mesa's software device takes minutes for a picture with anisotropy.
  const bool isSoftware = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
  VkSamplerCreateInfo info{};
  info.magFilter = info.minFilter = VK_FILTER_LINEAR;
  info.mipmapMode = VK_SAMPLER_MIPMAP_MODE_LINEAR;
  info.maxLod = VK_LOD_CLAMP_NONE;
  info.anisotropyEnable = isSoftware ? VK_FALSE : features.samplerAnisotropy;
  info.maxAnisotropy = 2;
  tiled_ = sampler(device.device, info);
  info.addressModeU = info.addressModeV = info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  clamped_ = sampler(device.device, info);
  info.anisotropyEnable = VK_FALSE;
  info.mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST;
  info.magFilter = info.minFilter = VK_FILTER_NEAREST;
  texels_ = sampler(device.device, info);
  info.compareEnable = VK_TRUE;
  info.compareOp = VK_COMPARE_OP_LESS_OR_EQUAL;
  if (filtersDepth(device)) info.magFilter = info.minFilter = VK_FILTER_LINEAR;
  compared_ = sampler(device.device, info);
}

void Textures::makeWeaves(const GraphicsDevice& device) {
  const auto count = static_cast<std::uint32_t>(fabrics().size());
  constexpr VkExtent2D kSize{kWeaveTexels, kWeaveTexels};
  ImageOptions options{.format = VK_FORMAT_R8G8B8A8_SRGB,
                       .size = kSize,
                       .layers = count,
                       .levels = levelsOf(kSize),
                       .usage = kUsage};
  weaveColours_ = Image(device, options);
  options.format = VK_FORMAT_R8G8B8A8_UNORM;
  weaveReliefs_ = Image(device, options);
  std::vector<std::future<WeaveTexels>> weaves;
  for (const Fabric& fabric : fabrics())
    weaves.push_back(std::async(std::launch::async, weave, std::cref(fabric), kWeaveTexels));
  constexpr VkDeviceSize kBytes = VkDeviceSize{4} * kWeaveTexels * kWeaveTexels;
  const Buffer staging(device, 2 * kBytes * count, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, BufferAccess::kWritten);
  auto* out = static_cast<std::uint8_t*>(staging.data());
  for (std::size_t i = 0; i < weaves.size(); ++i) {
    const WeaveTexels texels = weaves[i].get();
    std::memcpy(out + 2 * kBytes * i, texels.colours.data(), kBytes);
    std::memcpy(out + 2 * kBytes * i + kBytes, texels.reliefs.data(), kBytes);
  }
  runNow(device, [&](VkCommandBuffer commands) {
    for (std::uint32_t i = 0; i < count; ++i) {
      recordTexels(commands, weaveColours_, i, kSize, staging.get(), 2 * kBytes * i, true);
      recordTexels(commands, weaveReliefs_, i, kSize, staging.get(), 2 * kBytes * i + kBytes, true);
    }
  });
}

VkDeviceSize Textures::stagingBytes() {
  return kPanelBytes + kLabelsPerFrame * kLabelBytes;
}

void Textures::record(VkCommandBuffer commands, const Stage& stage, const Buffer& staging) {
  ++calls_;
  auto* bytes = static_cast<std::uint8_t*>(staging.data());
  const Picture* picture = stage.panel.visible ? stage.panel.picture : nullptr;
  if (picture != nullptr && picture->revision != panelRevision_ && picture->width <= kPanelTexels[0] &&
      picture->height <= kPanelTexels[1])
    recordPanel(commands, *picture, staging);
  VkDeviceSize offset = kPanelBytes;
  std::uint32_t copied = 0;
  for (const Label& label : stage.labels) {
    const Picture& name = *label.picture;
    Layer* const layer = layerFor(label);
    if (layer == nullptr || name.width > kLabelSize.width || name.height > kLabelSize.height) continue;
    const bool isShown = layer->id == label.id && layer->revision == name.revision;
    if (!isShown && copied == kLabelsPerFrame) continue;
    layer->usedIn = calls_;
    if (isShown) continue;
    *layer = {label.id, name.revision, calls_};
    std::memcpy(bytes + offset, name.texels.data(), name.texels.size());
    recordTexels(commands, labels_, static_cast<std::uint32_t>(layer - layers_.data()),
                 {name.width, name.height}, staging.get(), offset, false);
    offset += kLabelBytes;
    ++copied;
  }
}

void Textures::recordPanel(VkCommandBuffer commands, const Picture& picture, const Buffer& staging) {
  const TexelRect all{0, 0, picture.width, picture.height};
  const bool isKnown = picture.since != 0 && picture.since == panelRevision_;
  panelRevision_ = picture.revision;
  panelCopies_.clear();
  auto* out = static_cast<std::uint8_t*>(staging.data());
  VkDeviceSize offset = 0;
  for (const TexelRect& rect : isKnown ? std::span(picture.changes) : std::span(&all, 1)) {
    const VkExtent2D size{rect.right - rect.left, rect.bottom - rect.top};
    panelCopies_.push_back(
        copyInto(panel_, 0, {static_cast<std::int32_t>(rect.left), static_cast<std::int32_t>(rect.top)}, size,
                 offset));
    const std::size_t rowBytes = std::size_t{4} * size.width;
    for (std::uint32_t row = rect.top; row < rect.bottom; ++row, offset += rowBytes)
      std::memcpy(out + offset, &picture.texels[4 * (std::size_t{row} * picture.width + rect.left)],
                  rowBytes);
  }
  if (!panelCopies_.empty()) recordTexels(commands, panel_, 0, panelCopies_, staging.get(), false);
}

int Textures::layerOf(const Label& label) const {
  for (std::size_t i = 0; i < layers_.size(); ++i)
    if (layers_[i].revision == label.picture->revision && layers_[i].id == label.id)
      return static_cast<int>(i);
  return -1;
}

// The layer of the participant, or else the one whose last use is longest ago.
Textures::Layer* Textures::layerFor(const Label& label) {
  for (Layer& layer : layers_)
    if (layer.revision != 0 && layer.id == label.id) return &layer;
  Layer& oldest = *std::min_element(layers_.begin(), layers_.end(),
                                    [](const Layer& a, const Layer& b) { return a.usedIn < b.usedIn; });
  return oldest.usedIn == calls_ ? nullptr : &oldest;
}

}  // namespace clothstream::xr
