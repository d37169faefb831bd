// SPDX-License-Identifier: MIT
// The Vulkan device that an OpenXR runtime wants (XR_KHR_vulkan_enable2).
#pragma once

#include "clients/xr/openxr/instance.h"
#include "clients/xr/render/device.h"

namespace clothstream::xr {

class Graphics {
 public:
  // Throws an XrError or a std::runtime_error that says what is missing. openVulkanLoader() comes first.
  explicit Graphics(const Instance& instance);
  ~Graphics();
  Graphics(const Graphics&) = delete;
  Graphics& operator=(const Graphics&) = delete;

  const GraphicsDevice& device() const { return device_; }
  XrGraphicsBindingVulkan2KHR binding() const;

 private:
  void choose(const Instance& instance);

  GraphicsDevice device_;
};

}  // namespace clothstream::xr
