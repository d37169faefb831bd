// SPDX-License-Identifier: MIT
#include "server/vulkan/batch_table.h"

#include <algorithm>
#include <array>

namespace clothstream::vulkan {
namespace {

constexpr std::size_t kFirstBytes = 1 << 16;
}  // namespace

void BatchTable::begin() {
  used_ = 0;
  number_ = ++device_->handles().batches;
}

void BatchTable::grow() {
  const std::size_t bytes = std::max(kFirstBytes, 2 * std::max(used_, capacity()));
  staging_ = Buffer(*device_, BufferPurpose::upload, bytes);
  onDevice_ = Buffer(*device_, BufferPurpose::state, bytes);
  first_ = onDevice_.handles().address;
  begin();
}

std::size_t BatchTable::reserve(std::size_t bytes, std::size_t alignment) {
  const std::size_t offset = (used_ + alignment - 1) / alignment * alignment;
  used_ = offset + bytes;
  return offset;
}

void BatchTable::write(std::size_t offset, const void* from, std::size_t bytes) {
  if (offset + bytes <= capacity()) std::memcpy(staging_.mapped().data() + offset, from, bytes);
}

BatchTable::Entries BatchTable::entries(std::size_t count) {
  const std::size_t offset = reserve(count * sizeof(SharedEntry), alignof(SharedEntry));
  return {addressOf(offset), offset};
}

void BatchTable::set(const Entries& entries, std::size_t index, const SharedEntry& entry) {
  write(entries.offset + index * sizeof(entry), &entry, sizeof(entry));
}

vk::DeviceAddress BatchTable::push(std::span<const std::byte> push) {
  if (push.empty()) return 0;
  const std::size_t offset = reserve(push.size(), kSharedAlignment);
  write(offset, push.data(), push.size());
  return addressOf(offset);
}

vk::DeviceAddress BatchTable::record(const Bindings::Handles& bindings) {
  if (bindings.batch != number_) {
    bindings.record = record(bindings.buffers);
    bindings.batch = number_;
  }
  return bindings.record;
}

vk::DeviceAddress BatchTable::record(std::span<const BoundBufferAddress> buffers) {
  const std::size_t offset = reserve(bytesOfRecord(buffers.size()), kSharedAlignment);
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::uint64_t address = buffers[i].buffer->address;
    const auto bytes = static_cast<std::uint32_t>(buffers[i].bytes);
    write(offset + addressInRecord(i), &address, sizeof(address));
    write(offset + bytesInRecord(buffers.size(), i), &bytes, sizeof(bytes));
  }
  return addressOf(offset);
}

}  // namespace clothstream::vulkan
