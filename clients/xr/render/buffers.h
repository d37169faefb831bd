// SPDX-License-Identifier: MIT
// Buffers and their memory.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>

#include "clients/xr/render/handle.h"

namespace clothstream::xr {

// Allocates memory of a type with the first of these sets of properties that there is and that has space.
// Throws std::runtime_error if there is no such memory.
Owned<VkDeviceMemory> allocateMemory(const GraphicsDevice& device, const VkMemoryRequirements& needs,
                                     std::initializer_list<VkMemoryPropertyFlags> wanted);

// How the program uses the memory of a buffer: not at all; it writes it; or it reads it. The latter two are
// mapped as long as the buffer exists, and need no flushes.
enum class BufferAccess { kNone, kWritten, kRead };

// A buffer with its own memory.
class Buffer {
 public:
  Buffer() = default;
  // `bytes` is at least 1.
  Buffer(const GraphicsDevice& device, VkDeviceSize bytes, VkBufferUsageFlags usage, BufferAccess access);

  VkBuffer get() const { return buffer_.get(); }
  VkDeviceSize bytes() const { return bytes_; }
  // Null with BufferAccess::kNone.
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
