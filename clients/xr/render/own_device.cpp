// SPDX-License-Identifier: MIT
#include "clients/xr/render/own_device.h"

#include <algorithm>
#include <stdexcept>

#include "clients/xr/render/handle.h"

namespace clothstream::xr {
namespace {

const std::string kNoDriver =
    "no Vulkan device can draw the scene, because no driver is installed. Install one, such as Debian's "
    "mesa-vulkan-drivers, which has a software device too.";

// The smaller, the better.
int rankOf(VkPhysicalDevice physical) {
  VkPhysicalDeviceProperties properties{};
  vkGetPhysicalDeviceProperties(physical, &properties);
  switch (properties.deviceType) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    default:
      return 3;
  }
}

}  // namespace

OwnDevice::OwnDevice(std::span<const char* const> instanceExtensions,
                     std::span<const char* const> deviceExtensions) {
  const InstanceRequest request(instanceExtensions);
  const VkResult result = vkCreateInstance(request.info(), nullptr, &device_.instance);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) throw std::runtime_error(kNoDriver);
  check(result, "vkCreateInstance");
  try {
    loaded_ = std::make_unique<LoadedInstance>(device_.instance);
    choose(deviceExtensions);
  } catch (...) {
    release();
    throw;
  }
}

OwnDevice::~OwnDevice() {
  release();
}

void OwnDevice::release() {
  if (device_.device != VK_NULL_HANDLE) {
    vkDeviceWaitIdle(device_.device);
    vkDestroyDevice(device_.device, nullptr);
  }
  loaded_.reset();
  vkDestroyInstance(device_.instance, nullptr);
}

void OwnDevice::choose(std::span<const char* const> extensions) {
  std::uint32_t count = 0;
  check(vkEnumeratePhysicalDevices(device_.instance, &count, nullptr), "vkEnumeratePhysicalDevices");
  std::vector<VkPhysicalDevice> devices(count);
  check(vkEnumeratePhysicalDevices(device_.instance, &count, devices.data()), "vkEnumeratePhysicalDevices");
  std::ranges::stable_sort(devices, {}, rankOf);
  std::string reasons;
  for (VkPhysicalDevice physical : devices) {
    const std::string reason = unsuitableBecause(physical);
    if (!reason.empty()) {
      reasons += ' ' + reason;
      continue;
    }
    device_.physical = physical;
    device_.queueFamily = graphicsQueueFamily(physical).value();
    const DeviceRequest request(physical, device_.queueFamily, extensions);
    check(vkCreateDevice(physical, request.info(), nullptr, &device_.device), "vkCreateDevice");
    vkGetDeviceQueue(device_.device, device_.queueFamily, 0, &device_.queue);
    VkPhysicalDeviceProperties properties{};
    vkGetPhysicalDeviceProperties(physical, &properties);
    name_ = properties.deviceName;
    return;
  }
  throw std::runtime_error(devices.empty() ? kNoDriver : "no Vulkan device can draw the scene." + reasons);
}

VkSampleCountFlagBits samplesOf(VkPhysicalDevice physical, std::uint32_t wanted) {
  VkPhysicalDeviceProperties properties{};
  vkGetPhysicalDeviceProperties(physical, &properties);
  const VkSampleCountFlags allowed =
      properties.limits.framebufferColorSampleCounts & properties.limits.framebufferDepthSampleCounts;
  std::uint32_t samples = wanted;
  while (samples > 1 && (allowed & samples) == 0) samples /= 2;
  return static_cast<VkSampleCountFlagBits>(samples);
}

}  // namespace clothstream::xr
