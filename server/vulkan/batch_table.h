// SPDX-License-Identifier: MIT
// Entries, push constants and addresses that the shared kernels of a batch read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/handles.h"
#include "server/vulkan/shared_code.h"

namespace clothstream::vulkan {

// The CPU writes the table into mapped memory, and the device copies it at the start of the batch, because
// kernels read the memory of a GPU faster. Only for this folder, like handles.h.
class BatchTable {
 public:
  explicit BatchTable(const Device& device) : device_(&device) {}

  // Clears the table. The batch that used it must be complete.
  void begin();
  // Makes the table larger, and clears it.
  void grow();
  // False if something did not fit since begin().
  bool isComplete() const { return used_ <= capacity(); }
  std::size_t bytes() const { return used_; }

  // Places for `count` entries side by side.
  struct Entries {
    vk::DeviceAddress address = 0;
    std::size_t offset = 0;
  };
  Entries entries(std::size_t count);
  void set(const Entries& entries, std::size_t index, const SharedEntry& entry);
  // Copies push constants into the table. Returns their address; 0 if there are none.
  vk::DeviceAddress push(std::span<const std::byte> push);
  // Puts the record of a kernel's buffers into the table, once for each batch. Returns its address.
  vk::DeviceAddress record(const Bindings::Handles& bindings);
  vk::DeviceAddress record(std::span<const BoundBufferAddress> buffers);

  vk::Buffer staging() const { return *staging_.handles().buffer; }
  vk::Buffer onDevice() const { return *onDevice_.handles().buffer; }

 private:
  std::size_t capacity() const { return onDevice_.bytes(); }
  // Reserves bytes, and returns their offset. They exist only if they fit.
  std::size_t reserve(std::size_t bytes, std::size_t alignment);
  void write(std::size_t offset, const void* from, std::size_t bytes);
  vk::DeviceAddress addressOf(std::size_t offset) const { return first_ + offset; }

  const Device* device_;
  Buffer staging_, onDevice_;    // none at first
  vk::DeviceAddress first_ = 0;  // address of the table
  std::size_t used_ = 0;
  std::uint64_t number_ = 0;  // of the batch
};

}  // namespace clothstream::vulkan
