// SPDX-License-Identifier: MIT
// Device memory, created for a purpose.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "server/vulkan/device.h"

namespace clothstream::vulkan {

enum class BufferPurpose : std::uint8_t {
  state,     // data on the device; kernels and copies read and write it
  texels,    // state that kernels also read as RGBA32F texels (fast for gathers on software devices)
  upload,    // written by the CPU through mapped(), read by kernels and copies
  readback,  // written by kernels and copies, read by the CPU through mapped()
  indirect,  // state that also has dispatch sizes
};

// Move-only. Shares an allocation of memory with other buffers of the device. The contents start undefined:
// they may be those of a buffer that was destroyed. Throws std::runtime_error, which names the size, if
// memory or the device's allocations (Limits::maxAllocations) run out.
class Buffer {
 public:
  Buffer();
  Buffer(const Device& device, BufferPurpose purpose, std::size_t bytes);
  ~Buffer();
  Buffer(Buffer&&) noexcept;
  Buffer& operator=(Buffer&&) noexcept;

  std::size_t bytes() const { return bytes_; }

  // Memory on all devices of the buffers that the calling thread has made, less that of the buffers that it
  // has destroyed, in bytes modulo 2^64. The difference of two calls is what the work between them has added.
  static std::uint64_t bytesOfThread();

  // The whole buffer, for upload and readback; empty for the other purposes. Host-coherent. Writes of kernels
  // are visible once the submission's timeline value is reached (Recorder ends every recording with the
  // necessary barrier).
  template <typename T = std::byte>
  std::span<T> mapped() const {
    return {static_cast<T*>(mapped_), mapped_ == nullptr ? 0 : bytes_ / sizeof(T)};
  }

  // Only for this folder (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  std::size_t bytes_ = 0;
  void* mapped_ = nullptr;
  std::unique_ptr<Handles> handles_;
};

}  // namespace clothstream::vulkan
