// SPDX-License-Identifier: MIT
// Device memory, made by purpose.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "server/vulkan/device.h"

namespace clothstream::vulkan {

enum class BufferPurpose : std::uint8_t {
  state,     // lives on the device; storage, copies either way
  texels,    // state that kernels also read as RGBA32F texels (the fast path for gathers on software devices)
  upload,    // written by the CPU through mapped(), read by kernels and copies
  readback,  // written by kernels and copies, read by the CPU through mapped()
  indirect,  // state that also holds dispatch sizes
};

// Move-only. Contents start undefined. Throws std::runtime_error naming the size when memory runs out.
class Buffer {
 public:
  Buffer();
  Buffer(const Device& device, BufferPurpose purpose, std::size_t bytes);
  ~Buffer();
  Buffer(Buffer&&) noexcept;
  Buffer& operator=(Buffer&&) noexcept;

  std::size_t bytes() const { return bytes_; }

  // The whole buffer, for upload and readback; empty for the others. Host-coherent. What kernels wrote is
  // visible once the submission's timeline value is reached (Recorder ends every recording with the barrier
  // for it).
  template <typename T = std::byte>
  std::span<T> mapped() const {
    return {static_cast<T*>(mapped_), mapped_ == nullptr ? 0 : bytes_ / sizeof(T)};
  }

  // For this room alone (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  std::size_t bytes_ = 0;
  void* mapped_ = nullptr;
  std::unique_ptr<Handles> handles_;
};

}  // namespace clothstream::vulkan
