// SPDX-License-Identifier: MIT
// Device memory, created for a purpose.
#include "server/vulkan/buffer.h"

#include <cassert>
#include <optional>

#include <fmt/format.h>

#include "server/vulkan/handles.h"

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
      return {storage | Usage::eUniformTexelBuffer | Usage::eStorageTexelBuffer, {}, Property::eDeviceLocal};
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

std::uint32_t memoryType(const Device& device, std::uint32_t typeBits, const Traits& traits) {
  const vk::PhysicalDeviceMemoryProperties memory = device.handles().physical.getMemoryProperties();
  const auto find = [&](vk::MemoryPropertyFlags flags) -> std::optional<std::uint32_t> {
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
      if ((typeBits >> i & 1u) != 0 && (memory.memoryTypes[i].propertyFlags & flags) == flags) return i;
    return std::nullopt;
  };
  if (const auto best = find(traits.wanted | traits.preferred)) return *best;
  if (const auto good = find(traits.wanted)) return *good;
  throw std::runtime_error(
      fmt::format("{} has no memory that is {}", device.info().name, vk::to_string(traits.wanted)));
}

}  // namespace

std::uint64_t Buffer::bytesOfThread() {
  return MemoryRange::bytesOfThread();
}

Buffer::Buffer() = default;
Buffer::~Buffer() = default;
Buffer::Buffer(Buffer&&) noexcept = default;
Buffer& Buffer::operator=(Buffer&&) noexcept = default;

Buffer::Buffer(const Device& device, BufferPurpose purpose, std::size_t bytes)
    : bytes_(bytes), handles_(std::make_unique<Handles>()) {
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
  if (!device.executes()) {
    if (!mapped) return;
    handles_->hostBytes.resize(bytes);
    mapped_ = handles_->hostBytes.data();
    return;
  }
  Traits traits = traitsOf(purpose);
  if (device.hasAddresses()) traits.usage |= Usage::eShaderDeviceAddress;
  const vk::raii::Device& vulkan = device.handles().device;
  try {
    handles_->buffer = vk::raii::Buffer(vulkan, vk::BufferCreateInfo{.size = bytes, .usage = traits.usage});
    const vk::MemoryRequirements needs = handles_->buffer.getMemoryRequirements();
    const MemoryRange& range = handles_->range.emplace(*device.handles().memory, needs,
                                                       memoryType(device, needs.memoryTypeBits, traits));
    handles_->buffer.bindMemory(range.memory(), range.offset());
    if (mapped) mapped_ = range.mapped();
    if (device.hasAddresses())
      handles_->address = vulkan.getBufferAddress(vk::BufferDeviceAddressInfo{.buffer = *handles_->buffer});
    if (texels)
      handles_->texelView = vk::raii::BufferView(
          vulkan, vk::BufferViewCreateInfo{
                      .buffer = *handles_->buffer, .format = kTexelFormat, .range = VK_WHOLE_SIZE});
  } catch (const vk::SystemError& error) {
    throw std::runtime_error(
        fmt::format("no buffer of {} bytes can be made on {}: {}", bytes, device.info().name, error.what()));
  }
}

}  // namespace clothstream::vulkan
