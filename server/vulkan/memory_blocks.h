// SPDX-License-Identifier: MIT
// Device memory of buffers: ranges of a few large allocations.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <string>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/free_ranges.h"

namespace clothstream::vulkan {

// An allocation of device memory, which buffers share.
struct MemoryBlock {
  std::uint32_t type = 0;  // index of its memory type
  vk::raii::DeviceMemory memory = nullptr;
  std::byte* mapped = nullptr;  // the whole block, if its type is host-visible and host-coherent
  FreeRanges ranges;
};

struct MemorySettings {
  std::string device = {};         // name, for errors
  std::uint32_t maxBlocks = 0;     // Limits::maxAllocations
  std::uint64_t largestBlock = 0;  // DeviceOptions::largestBlock
  bool addresses = false;          // kernels may read buffers by address
  bool marksFreshMemory = false;   // fills new blocks with ones, where the CPU can
};

// Blocks of each memory type. A new block is as large as those of its type together, within 4 MiB and 256
// MiB, and at most an eighth of its heap, so that the number of blocks grows with the logarithm of the
// memory, and above 256 MiB with the memory divided by 256 MiB. A buffer that is larger has a block for
// itself. If the device has no memory for a block, smaller ones are tried. Blocks never move. An empty block
// is freed, except for the smallest of each type, so that a small scene that comes and goes allocates
// nothing.
//
// Blocks have buffers alone, so that bufferImageGranularity does not matter. Neither does
// nonCoherentAtomSize, because memory that the CPU uses is coherent. Thread-safe.
class MemoryBlocks {
 public:
  // `device` must outlive this, and this all ranges.
  MemoryBlocks(const vk::raii::Device& device, const vk::PhysicalDeviceMemoryProperties& memory,
               MemorySettings settings);

  std::uint32_t count() const;
  // Memory of all blocks, and of all ranges.
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t usedBytes() const { return usedBytes_; }

 private:
  friend class MemoryRange;
  using Block = std::list<MemoryBlock>::iterator;
  struct Place {
    Block block;
    std::uint64_t offset;
  };
  Place take(const vk::MemoryRequirements& needs, std::uint32_t type);
  void giveBack(const Place& place, std::uint64_t bytes);

  // These need the mutex.
  std::uint64_t largestBlock(std::uint32_t type) const;
  Block addBlock(std::uint32_t type, std::uint64_t bytes);
  Block allocate(std::uint32_t type, std::uint64_t bytes);
  void free(Block block);
  bool freeEmptyBlocks();

  const vk::raii::Device& device_;
  const vk::PhysicalDeviceMemoryProperties memory_;
  const MemorySettings settings_;
  std::atomic<std::uint64_t> bytes_{0}, usedBytes_{0};
  mutable std::mutex mutex_;       // protects the next one
  std::list<MemoryBlock> blocks_;  // oldest first
};

// Memory of one buffer, while this object lives.
class MemoryRange {
 public:
  // `type` is one of the types that `needs` allows. Throws std::runtime_error if the device allows no further
  // allocation, and vk::SystemError if it has no memory.
  MemoryRange(MemoryBlocks& blocks, const vk::MemoryRequirements& needs, std::uint32_t type);
  ~MemoryRange();
  MemoryRange(const MemoryRange&) = delete;
  MemoryRange& operator=(const MemoryRange&) = delete;

  vk::DeviceMemory memory() const { return *place_.block->memory; }
  std::uint64_t offset() const { return place_.offset; }
  // Null if the CPU has no access.
  std::byte* mapped() const;

  // Memory on all devices of the ranges that the calling thread has made, less that of the ranges that it has
  // destroyed, in bytes modulo 2^64.
  static std::uint64_t bytesOfThread();

 private:
  MemoryBlocks& blocks_;
  const std::uint64_t bytes_;
  const MemoryBlocks::Place place_;
};

}  // namespace clothstream::vulkan
