// SPDX-License-Identifier: MIT
// The Vulkan device that the renderer draws with, and what it must be able to do. Functions of Vulkan are
// loaded at run time by volk; every source of this client includes <volk.h>, never <vulkan/vulkan.h>.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <volk.h>

namespace clothstream::xr {

// Handles that whoever made the device owns. They must outlive everything that uses them. All functions of
// this client that submit to the queue are called from one thread.
struct GraphicsDevice {
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  std::uint32_t queueFamily = 0;
  VkQueue queue = VK_NULL_HANDLE;
};

// Version of Vulkan that instance and device must have. Multiview and depth resolves are part of it.
inline constexpr std::uint32_t kVulkanVersion = VK_API_VERSION_1_2;

// Opens the Vulkan loader of the system and fills in the functions that need no instance. Call once, first.
// Throws std::runtime_error with what to install if there is none.
void openVulkanLoader();

// The renderer needs these extensions in addition to kVulkanVersion; there are none at present.
std::vector<const char*> requiredDeviceExtensions();

// Reason why the renderer cannot use a device, as a sentence; "" if it can.
std::string unsuitableBecause(VkPhysicalDevice physical);

// Whether the device has VK_EXT_fragment_density_map, also for images that are not subsampled, such as those
// of swapchains.
bool hasDensityMaps(VkPhysicalDevice physical);

// First queue family with graphics and compute; none if there is none.
std::optional<std::uint32_t> graphicsQueueFamily(VkPhysicalDevice physical);

// Parameters of vkCreateInstance, or of xrCreateVulkanInstanceKHR. `extensions` must outlive the request.
// Validation, with checks of synchronisation, is on if the environment variable CLOTHSTREAM_VALIDATION is 1;
// the constructor throws std::runtime_error if the layer is not installed then.
class InstanceRequest {
 public:
  explicit InstanceRequest(std::span<const char* const> extensions);
  InstanceRequest(const InstanceRequest&) = delete;
  InstanceRequest& operator=(const InstanceRequest&) = delete;

  // Valid as long as the request.
  const VkInstanceCreateInfo* info() const { return &info_; }

 private:
  std::vector<const char*> extensions_, layers_;
  VkApplicationInfo application_{};
  VkDebugUtilsMessengerCreateInfoEXT messenger_{};
  VkValidationFeaturesEXT validation_{};
  VkInstanceCreateInfo info_{};
};

// Loads the functions of an instance. With validation, also logs and counts the messages of the layer. Make
// it right after the instance, and destroy it before the instance. At most one exists at a time.
class LoadedInstance {
 public:
  explicit LoadedInstance(VkInstance instance);
  ~LoadedInstance();
  LoadedInstance(const LoadedInstance&) = delete;
  LoadedInstance& operator=(const LoadedInstance&) = delete;

 private:
  VkInstance instance_;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
};

// Parameters of vkCreateDevice, or of xrCreateVulkanDeviceKHR: one queue of the family, and the features that
// the renderer needs. `extensions` are added to the required ones and must outlive the request. With
// `wantsDensity`, also what hasDensityMaps() has found.
class DeviceRequest {
 public:
  DeviceRequest(VkPhysicalDevice physical, std::uint32_t queueFamily, std::span<const char* const> extensions,
                bool wantsDensity = false);
  DeviceRequest(const DeviceRequest&) = delete;
  DeviceRequest& operator=(const DeviceRequest&) = delete;

  // Valid as long as the request.
  const VkDeviceCreateInfo* info() const { return &info_; }

 private:
  std::vector<const char*> extensions_;
  float priority_ = 1;
  VkDeviceQueueCreateInfo queue_{};
  VkPhysicalDeviceFragmentDensityMapFeaturesEXT density_{};
  VkPhysicalDeviceVulkan11Features multiview_{};
  VkPhysicalDeviceFeatures2 features_{};
  VkDeviceCreateInfo info_{};
};

// Number of messages of the validation layer in this process; 0 without validation. They are also logged as
// errors.
std::uint64_t validationMessages();

}  // namespace clothstream::xr
