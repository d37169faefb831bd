// SPDX-License-Identifier: MIT
// The Vulkan device that an OpenXR runtime wants (XR_KHR_vulkan_enable2).
#pragma once

#include <memory>

#include "clients/xr/openxr/instance.h"
#include "clients/xr/render/device.h"

namespace clothstream::xr {

class Graphics {
 public:
  // Throws an XrError or a std::runtime_error that says what is missing. openVulkanLoader() comes first.
  // `wantsDensity`: density maps are used where the device has them.
  Graphics(const Instance& instance, bool wantsDensity);
  ~Graphics();
  Graphics(const Graphics&) = delete;
  Graphics& operator=(const Graphics&) = delete;

  const GraphicsDevice& device() const { return device_; }
  XrGraphicsBindingVulkan2KHR binding() const;
  bool hasDensity() const { return hasDensity_; }

 private:
  void choose(const Instance& instance, bool wantsDensity);
  void release();

  GraphicsDevice device_;
  std::unique_ptr<LoadedInstance> loaded_;
  bool hasDensity_ = false;
};

}  // namespace clothstream::xr
