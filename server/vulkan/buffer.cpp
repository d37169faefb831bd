// SPDX-License-Identifier: MIT
// Device memory, made by purpose.
#include "server/vulkan/buffer.h"

#include <cassert>

#include <fmt/format.h>

namespace clothstream::vulkan {
namespace {

using Usage = vk::BufferUsageFlagBits;
using Property = vk::MemoryPropertyFlagBits;

constexpr vk::Format kTexelFormat = vk::Format::eR32G32B32A32Sfloat;
constexpr std::size_t kTexelBytes = 16;

struct Traits {
  vk::BufferUsageFlags usage;
  vk::MemoryPropertyFlags wanted;
  vk::MemoryPropertyFlags preferred;
};

Traits traitsOf(BufferPurpose purpose) {
  const vk::BufferUsageFlags storage = Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst;
  const vk::MemoryPropertyFlags mapped = Property::eHostVisible | Property::eHostCoherent;
  switch (purpose) {
    case BufferPurpose::texels:
      return {storage | Usage::eUniformTexelBuffer, {}, Property::eDeviceLocal};
    case BufferPurpose::upload:
      return {storage, mapped, {}};
    case BufferPurpose::readback:
      return {storage, mapped, Property::eHostCached};
    case BufferPurpose::indirect:
      return {storage | Usage::eIndirectBuffer, {}, Property::eDeviceLocal};
    case BufferPurpose::state:
      break;
  }
  return {storage, {}, Property::eDeviceLocal};
}

}  // namespace

Buffer::Buffer(const Device& device, BufferPurpose purpose, std::size_t bytes) : bytes_(bytes) {
  assert(bytes > 0);
  const bool texels = purpose == BufferPurpose::texels;
  const bool mapped = purpose == BufferPurpose::upload || purpose == BufferPurpose::readback;
  assert(!texels || bytes % kTexelBytes == 0);
  const Limits& limits = device.limits();
  if (!mapped && bytes > limits.maxStorageRange)
    throw std::runtime_error(
        fmt::format("a buffer of {} bytes is more than the {} that kernels can bind on {}", bytes,
                    limits.maxStorageRange, device.info().name));
  if (texels && bytes / kTexelBytes > limits.maxTexelElements)
    throw std::runtime_error(
        fmt::format("a buffer of {} texels is more than the {} that kernels can read on {}",
                    bytes / kTexelBytes, limits.maxTexelElements, device.info().name));
  const Traits traits = traitsOf(purpose);
  try {
    buffer_ = vk::raii::Buffer(device.handle(), vk::BufferCreateInfo{.size = bytes, .usage = traits.usage});
    const vk::MemoryRequirements needs = buffer_.getMemoryRequirements();
    memory_ = vk::raii::DeviceMemory(
        device.handle(), vk::MemoryAllocateInfo{.allocationSize = needs.size,
                                                .memoryTypeIndex = device.memoryType(
                                                    needs.memoryTypeBits, traits.wanted, traits.preferred)});
    buffer_.bindMemory(*memory_, 0);
    if (mapped) mapped_ = memory_.mapMemory(0, VK_WHOLE_SIZE);
    if (texels)
      texelView_ = vk::raii::BufferView(
          device.handle(),
          vk::BufferViewCreateInfo{.buffer = *buffer_, .format = kTexelFormat, .range = VK_WHOLE_SIZE});
  } catch (const vk::SystemError& error) {
    throw std::runtime_error(
        fmt::format("no buffer of {} bytes can be made on {}: {}", bytes, device.info().name, error.what()));
  }
}

}  // namespace clothstream::vulkan
