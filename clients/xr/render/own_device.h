// SPDX-License-Identifier: MIT
// A Vulkan device that this program makes itself, where there is no OpenXR.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "clients/xr/render/device.h"

namespace clothstream::xr {

class OwnDevice {
 public:
  // Takes the first suitable device, discrete ones before integrated ones, and software last.
  // openVulkanLoader() was called before. Throws std::runtime_error that says why each device is unsuitable.
  OwnDevice(std::span<const char* const> instanceExtensions, std::span<const char* const> deviceExtensions);
  ~OwnDevice();
  OwnDevice(const OwnDevice&) = delete;
  OwnDevice& operator=(const OwnDevice&) = delete;

  const GraphicsDevice& get() const { return device_; }
  const std::string& name() const { return name_; }

 private:
  void choose(std::span<const char* const> extensions);
  void release();

  GraphicsDevice device_;
  std::unique_ptr<LoadedInstance> loaded_;
  std::string name_;
};

// Largest number of samples per pixel that is wanted and that the device allows for colour and depth.
VkSampleCountFlagBits samplesOf(VkPhysicalDevice physical, std::uint32_t wanted);

}  // namespace clothstream::xr
