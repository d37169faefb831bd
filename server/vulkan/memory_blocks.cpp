// SPDX-License-Identifier: MIT
// Device memory of buffers: ranges of a few large allocations.
#include "server/vulkan/memory_blocks.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace clothstream::vulkan {
namespace {

constexpr std::uint64_t kSmallestBlock = std::uint64_t{4} << 20, kLargestBlock = std::uint64_t{256} << 20;
constexpr std::uint64_t kBlocksOfHeap = 8;  // a block takes at most this part of its heap
// Content of fresh memory with MemorySettings::marksFreshMemory: no float is a number, and no index is valid.
constexpr int kMark = 0xff;

thread_local std::uint64_t rangeBytesOfThread = 0;

}  // namespace

MemoryBlocks::MemoryBlocks(const vk::raii::Device& device, const vk::PhysicalDeviceMemoryProperties& memory,
                           MemorySettings settings)
    : device_(device), memory_(memory), settings_(std::move(settings)) {}

std::uint32_t MemoryBlocks::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::uint32_t>(blocks_.size());
}

std::uint64_t MemoryBlocks::largestBlock(std::uint32_t type) const {
  const std::uint64_t heap = memory_.memoryHeaps[memory_.memoryTypes[type].heapIndex].size;
  const std::uint64_t largest = std::min(kLargestBlock, heap / kBlocksOfHeap);
  return settings_.largestBlock > 0 ? std::min(largest, settings_.largestBlock) : largest;
}

MemoryBlocks::Place MemoryBlocks::take(const vk::MemoryRequirements& needs, std::uint32_t type) {
  const std::lock_guard lock(mutex_);
  for (Block block = blocks_.begin(); block != blocks_.end(); ++block) {
    if (block->type != type) continue;
    if (const auto offset = block->ranges.take(needs.size, needs.alignment)) return {block, *offset};
  }
  const Block added = addBlock(type, needs.size);
  return {added, added->ranges.take(needs.size, needs.alignment).value()};
}

MemoryBlocks::Block MemoryBlocks::addBlock(std::uint32_t type, std::uint64_t bytes) {
  if (blocks_.size() >= settings_.maxBlocks && !freeEmptyBlocks())
    throw std::runtime_error(fmt::format(
        "a buffer that takes {} bytes has no room in the {} allocations of memory that {} allows: "
        "use fewer scenes",
        bytes, settings_.maxBlocks, settings_.device));
  std::uint64_t ofType = 0;
  for (const MemoryBlock& block : blocks_)
    if (block.type == type) ofType += block.ranges.bytes();
  std::uint64_t size = std::max(bytes, std::min(std::max(ofType, kSmallestBlock), largestBlock(type)));
  for (;;) {
    try {
      return allocate(type, size);
    } catch (const vk::SystemError&) {
      if (freeEmptyBlocks()) continue;
      if (size == bytes) throw;
      size = std::max(bytes, size / 2);
    }
  }
}

MemoryBlocks::Block MemoryBlocks::allocate(std::uint32_t type, std::uint64_t bytes) {
  const vk::MemoryAllocateFlagsInfo addresses{.flags = vk::MemoryAllocateFlagBits::eDeviceAddress};
  MemoryBlock block{.type = type,
                    .memory = vk::raii::DeviceMemory(
                        device_, vk::MemoryAllocateInfo{.pNext = settings_.addresses ? &addresses : nullptr,
                                                        .allocationSize = bytes,
                                                        .memoryTypeIndex = type}),
                    .ranges = FreeRanges(bytes)};
  const vk::MemoryPropertyFlags mappable =
      vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent;
  if ((memory_.memoryTypes[type].propertyFlags & mappable) == mappable) {
    block.mapped = static_cast<std::byte*>(block.memory.mapMemory(0, VK_WHOLE_SIZE));
    if (settings_.marksFreshMemory) std::memset(block.mapped, kMark, bytes);
  }
  bytes_ += bytes;
  return blocks_.insert(blocks_.end(), std::move(block));
}

void MemoryBlocks::free(Block block) {
  bytes_ -= block->ranges.bytes();
  blocks_.erase(block);
}

bool MemoryBlocks::freeEmptyBlocks() {
  const std::size_t before = blocks_.size();
  for (Block block = blocks_.begin(); block != blocks_.end();) {
    const Block present = block++;
    if (present->ranges.allFree()) free(present);
  }
  return blocks_.size() < before;
}

void MemoryBlocks::giveBack(const Place& place, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  place.block->ranges.giveBack(place.offset, bytes);
  if (!place.block->ranges.allFree()) return;
  const auto isOther = [&](const MemoryBlock& block) {
    return &block != &*place.block && block.type == place.block->type && block.ranges.allFree();
  };
  const std::uint64_t size = place.block->ranges.bytes();
  const Block other = std::ranges::find_if(blocks_, isOther);
  if (other != blocks_.end())
    free(size < other->ranges.bytes() ? other : place.block);
  else if (size > largestBlock(place.block->type))
    free(place.block);
}

MemoryRange::MemoryRange(MemoryBlocks& blocks, const vk::MemoryRequirements& needs, std::uint32_t type)
    : blocks_(blocks), bytes_(needs.size), place_(blocks.take(needs, type)) {
  blocks_.usedBytes_ += bytes_;
  rangeBytesOfThread += bytes_;
}

MemoryRange::~MemoryRange() {
  blocks_.giveBack(place_, bytes_);
  blocks_.usedBytes_ -= bytes_;
  rangeBytesOfThread -= bytes_;
}

std::byte* MemoryRange::mapped() const {
  return place_.block->mapped == nullptr ? nullptr : place_.block->mapped + place_.offset;
}

std::uint64_t MemoryRange::bytesOfThread() {
  return rangeBytesOfThread;
}

}  // namespace clothstream::vulkan
