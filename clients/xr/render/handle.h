// SPDX-License-Identifier: MIT
// Owners of Vulkan handles, and the check of results.
#pragma once

#include <utility>

#include "clients/xr/render/device.h"

namespace clothstream::xr {

// Throws std::runtime_error that names the call if the result is an error.
void check(VkResult result, const char* call);

// Owns a handle of a device.
template <typename T>
class Owned {
 public:
  using Destroy = void(VKAPI_PTR*)(VkDevice, T, const VkAllocationCallbacks*);

  Owned() = default;
  Owned(VkDevice device, T handle, Destroy destroy) : device_(device), handle_(handle), destroy_(destroy) {}
  Owned(Owned&& other) noexcept
      : device_(other.device_), handle_(std::exchange(other.handle_, T{})), destroy_(other.destroy_) {}
  Owned& operator=(Owned&& other) noexcept {
    if (this == &other) return *this;
    reset();
    device_ = other.device_;
    handle_ = std::exchange(other.handle_, T{});
    destroy_ = other.destroy_;
    return *this;
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() { reset(); }

  void reset() {
    if (handle_ != T{}) destroy_(device_, handle_, nullptr);
    handle_ = T{};
  }
  T get() const { return handle_; }

 private:
  VkDevice device_ = VK_NULL_HANDLE;
  T handle_{};
  Destroy destroy_ = nullptr;
};

}  // namespace clothstream::xr
