// SPDX-License-Identifier: MIT
#include "clients/xr/render/device.h"

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

namespace clothstream::xr {

void openVulkanLoader() {
  if (volkInitialize() != VK_SUCCESS)
    throw std::runtime_error(
        "the Vulkan loader libvulkan.so.1 cannot be opened. Install Debian's libvulkan1, and a driver: "
        "mesa-vulkan-drivers has the software device and drives AMD and Intel GPUs; for NVIDIA install "
        "nvidia-driver "
        "and nvidia-vulkan-icd");
}

std::vector<const char*> requiredDeviceExtensions() {
  return {};
}

std::string unsuitableBecause(VkPhysicalDevice physical) {
  VkPhysicalDeviceProperties properties{};
  vkGetPhysicalDeviceProperties(physical, &properties);
  const std::string name = properties.deviceName;
  if (properties.apiVersion < kVulkanVersion)
    return fmt::format("{} has Vulkan {}.{}; the renderer needs 1.2. Update the driver.", name,
                       VK_API_VERSION_MAJOR(properties.apiVersion),
                       VK_API_VERSION_MINOR(properties.apiVersion));
  VkPhysicalDeviceVulkan11Features multiview{};
  multiview.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
  VkPhysicalDeviceFeatures2 features{};
  features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  features.pNext = &multiview;
  vkGetPhysicalDeviceFeatures2(physical, &features);
  if (multiview.multiview == VK_FALSE)
    return fmt::format("{} has no multiview, with which both eyes are drawn in one pass.", name);
  VkPhysicalDeviceDepthStencilResolveProperties resolve{};
  resolve.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DEPTH_STENCIL_RESOLVE_PROPERTIES;
  VkPhysicalDeviceProperties2 more{};
  more.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  more.pNext = &resolve;
  vkGetPhysicalDeviceProperties2(physical, &more);
  if ((resolve.supportedDepthResolveModes & VK_RESOLVE_MODE_SAMPLE_ZERO_BIT) == 0)
    return fmt::format("{} cannot resolve depth.", name);
  if (!graphicsQueueFamily(physical)) return fmt::format("{} has no queue for graphics and compute.", name);
  return "";
}

bool hasDensityMaps(VkPhysicalDevice physical) {
  std::uint32_t count = 0;
  vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> extensions(count);
  vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, extensions.data());
  const auto isWanted = [](const VkExtensionProperties& each) {
    return std::string_view(each.extensionName) == VK_EXT_FRAGMENT_DENSITY_MAP_EXTENSION_NAME;
  };
  if (std::ranges::none_of(extensions, isWanted)) return false;
  VkPhysicalDeviceFragmentDensityMapFeaturesEXT density{};
  density.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FRAGMENT_DENSITY_MAP_FEATURES_EXT;
  VkPhysicalDeviceFeatures2 features{};
  features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  features.pNext = &density;
  vkGetPhysicalDeviceFeatures2(physical, &features);
  return density.fragmentDensityMap == VK_TRUE && density.fragmentDensityMapNonSubsampledImages == VK_TRUE;
}

std::optional<std::uint32_t> graphicsQueueFamily(VkPhysicalDevice physical) {
  constexpr VkQueueFlags kNeeded = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
  std::uint32_t count = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
  for (std::uint32_t i = 0; i < count; ++i)
    if ((families[i].queueFlags & kNeeded) == kNeeded) return i;
  return std::nullopt;
}

}  // namespace clothstream::xr
