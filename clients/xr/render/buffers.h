// SPDX-License-Identifier: MIT
// Buffers and their memory.
#pragma once

#include <cstdint>
#include <functional>

#include "clients/xr/render/handle.h"

namespace clothstream::xr {

// Index of a type of memory with these properties among the allowed types; `preferred` ones are added where
// there are such. Throws std::runtime_error if there is none.
std::uint32_t memoryType(const GraphicsDevice& device, std::uint32_t allowed, VkMemoryPropertyFlags needed,
                         VkMemoryPropertyFlags preferred);

// A buffer with its own memory.
class Buffer {
 public:
  Buffer() = default;
  // `mapped`: the memory is visible to the program as long as the buffer exists, without flushes; else it is
  // that of the device alone. `bytes` is at least 1.
  Buffer(const GraphicsDevice& device, VkDeviceSize bytes, VkBufferUsageFlags usage, bool mapped);

  VkBuffer get() const { return buffer_.get(); }
  VkDeviceSize bytes() const { return bytes_; }
  // Null unless mapped.
  void* data() const { return data_; }

 private:
  Owned<VkDeviceMemory> memory_;  // outlives the buffer
  Owned<VkBuffer> buffer_;
  VkDeviceSize bytes_ = 0;
  void* data_ = nullptr;
};

// Records commands with `record`, submits them and waits for them.
void runNow(const GraphicsDevice& device, const std::function<void(VkCommandBuffer)>& record);

// A buffer of the device with a copy of these bytes. Waits for the copy. Empty data gives a buffer of 16
// bytes.
Buffer deviceBuffer(const GraphicsDevice& device, const void* data, VkDeviceSize bytes,
                    VkBufferUsageFlags usage);

}  // namespace clothstream::xr
