// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/graphics.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace clothstream::xr {

Graphics::Graphics(const Instance& instance, bool wantsDensity) {
  try {
    choose(instance, wantsDensity);
  } catch (...) {
    release();
    throw;
  }
}

Graphics::~Graphics() {
  vkDeviceWaitIdle(device_.device);
  release();
}

void Graphics::release() {
  if (device_.device) vkDestroyDevice(device_.device, nullptr);
  loaded_.reset();
  if (device_.instance) vkDestroyInstance(device_.instance, nullptr);
}

void Graphics::choose(const Instance& instance, bool wantsDensity) {
  auto needs = typed<XrGraphicsRequirementsVulkan2KHR>(XR_TYPE_GRAPHICS_REQUIREMENTS_VULKAN2_KHR);
  check(functionOf<PFN_xrGetVulkanGraphicsRequirements2KHR>(
            instance.get(), "xrGetVulkanGraphicsRequirements2KHR")(instance.get(), instance.system(), &needs),
        "xrGetVulkanGraphicsRequirements2KHR");
  constexpr XrVersion kOurs =
      XR_MAKE_VERSION(VK_API_VERSION_MAJOR(kVulkanVersion), VK_API_VERSION_MINOR(kVulkanVersion), 0);
  if (kOurs < needs.minApiVersionSupported)
    throw std::runtime_error(fmt::format("The OpenXR runtime needs Vulkan {}.{}; this program uses {}.{}",
                                         XR_VERSION_MAJOR(needs.minApiVersionSupported),
                                         XR_VERSION_MINOR(needs.minApiVersionSupported),
                                         XR_VERSION_MAJOR(kOurs), XR_VERSION_MINOR(kOurs)));

  const InstanceRequest instanceRequest({});
  auto instanceInfo = typed<XrVulkanInstanceCreateInfoKHR>(XR_TYPE_VULKAN_INSTANCE_CREATE_INFO_KHR);
  instanceInfo.systemId = instance.system();
  instanceInfo.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
  instanceInfo.vulkanCreateInfo = instanceRequest.info();
  VkResult vulkan = VK_SUCCESS;
  check(functionOf<PFN_xrCreateVulkanInstanceKHR>(instance.get(), "xrCreateVulkanInstanceKHR")(
            instance.get(), &instanceInfo, &device_.instance, &vulkan),
        "xrCreateVulkanInstanceKHR");
  check(vulkan, "vkCreateInstance");
  loaded_ = std::make_unique<LoadedInstance>(device_.instance);

  auto physicalInfo = typed<XrVulkanGraphicsDeviceGetInfoKHR>(XR_TYPE_VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR);
  physicalInfo.systemId = instance.system();
  physicalInfo.vulkanInstance = device_.instance;
  check(functionOf<PFN_xrGetVulkanGraphicsDevice2KHR>(instance.get(), "xrGetVulkanGraphicsDevice2KHR")(
            instance.get(), &physicalInfo, &device_.physical),
        "xrGetVulkanGraphicsDevice2KHR");
  if (const std::string reason = unsuitableBecause(device_.physical); !reason.empty())
    throw std::runtime_error(reason);
  device_.queueFamily = graphicsQueueFamily(device_.physical).value();

  hasDensity_ = wantsDensity && hasDensityMaps(device_.physical);
  const DeviceRequest deviceRequest(device_.physical, device_.queueFamily, {}, hasDensity_);
  auto deviceInfo = typed<XrVulkanDeviceCreateInfoKHR>(XR_TYPE_VULKAN_DEVICE_CREATE_INFO_KHR);
  deviceInfo.systemId = instance.system();
  deviceInfo.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
  deviceInfo.vulkanPhysicalDevice = device_.physical;
  deviceInfo.vulkanCreateInfo = deviceRequest.info();
  check(functionOf<PFN_xrCreateVulkanDeviceKHR>(instance.get(), "xrCreateVulkanDeviceKHR")(
            instance.get(), &deviceInfo, &device_.device, &vulkan),
        "xrCreateVulkanDeviceKHR");
  check(vulkan, "vkCreateDevice");
  volkLoadDevice(device_.device);
  vkGetDeviceQueue(device_.device, device_.queueFamily, 0, &device_.queue);
  VkPhysicalDeviceProperties properties;
  vkGetPhysicalDeviceProperties(device_.physical, &properties);
  spdlog::info("The headset's device is {}", properties.deviceName);
}

XrGraphicsBindingVulkan2KHR Graphics::binding() const {
  auto binding = typed<XrGraphicsBindingVulkan2KHR>(XR_TYPE_GRAPHICS_BINDING_VULKAN2_KHR);
  binding.instance = device_.instance;
  binding.physicalDevice = device_.physical;
  binding.device = device_.device;
  binding.queueFamilyIndex = device_.queueFamily;
  binding.queueIndex = 0;
  return binding;
}

}  // namespace clothstream::xr
