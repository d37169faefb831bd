// SPDX-License-Identifier: MIT
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include <spdlog/spdlog.h>

#include "clients/xr/render/device.h"

namespace clothstream::xr {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr VkValidationFeatureEnableEXT kSynchronization =
    VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;

std::atomic<std::uint64_t> messages = 0;

bool validates() {
  const char* value = std::getenv("CLOTHSTREAM_VALIDATION");
  return value != nullptr && *value != '\0' && std::string_view(value) != "0";
}

VkBool32 onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                   const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
  ++messages;
  spdlog::error("Vulkan validation: {}", data->pMessage);
  return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messengerInfo() {
  return {.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
          .pNext = nullptr,
          .flags = 0,
          .messageSeverity =
              VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
          .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
          .pfnUserCallback = onMessage,
          .pUserData = nullptr};
}

bool hasLayer(const char* name) {
  std::uint32_t count = 0;
  vkEnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vkEnumerateInstanceLayerProperties(&count, layers.data());
  for (const VkLayerProperties& layer : layers)
    if (std::strcmp(layer.layerName, name) == 0) return true;
  return false;
}

}  // namespace

InstanceRequest::InstanceRequest(std::span<const char* const> extensions)
    : extensions_(extensions.begin(), extensions.end()) {
  application_ = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                  .pNext = nullptr,
                  .pApplicationName = "clothstream-xr",
                  .applicationVersion = 1,
                  .pEngineName = nullptr,
                  .engineVersion = 0,
                  .apiVersion = kVulkanVersion};
  info_.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info_.pApplicationInfo = &application_;
  if (validates()) {
    if (!hasLayer(kValidationLayer))
      throw std::runtime_error(
          "CLOTHSTREAM_VALIDATION is set, but the Vulkan layer VK_LAYER_KHRONOS_validation was not found. "
          "Install "
          "Debian's vulkan-validationlayers, or unset the variable.");
    // The layer finds hazards between submissions only with this setting.
    setenv("VK_LAYER_ENABLES",
           "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT:"
           "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT",
           0);
    layers_.push_back(kValidationLayer);
    extensions_.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    messenger_ = messengerInfo();
    validation_ = {.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                   .pNext = &messenger_,
                   .enabledValidationFeatureCount = 1,
                   .pEnabledValidationFeatures = &kSynchronization,
                   .disabledValidationFeatureCount = 0,
                   .pDisabledValidationFeatures = nullptr};
    info_.pNext = &validation_;
  }
  info_.enabledLayerCount = static_cast<std::uint32_t>(layers_.size());
  info_.ppEnabledLayerNames = layers_.data();
  info_.enabledExtensionCount = static_cast<std::uint32_t>(extensions_.size());
  info_.ppEnabledExtensionNames = extensions_.data();
}

LoadedInstance::LoadedInstance(VkInstance instance) : instance_(instance) {
  volkLoadInstance(instance);
  if (!validates()) return;
  const VkDebugUtilsMessengerCreateInfoEXT info = messengerInfo();
  if (vkCreateDebugUtilsMessengerEXT(instance, &info, nullptr, &messenger_) != VK_SUCCESS)
    throw std::runtime_error("vkCreateDebugUtilsMessengerEXT failed: no messages of validation can be shown");
}

LoadedInstance::~LoadedInstance() {
  if (messenger_ != VK_NULL_HANDLE) vkDestroyDebugUtilsMessengerEXT(instance_, messenger_, nullptr);
}

DeviceRequest::DeviceRequest(VkPhysicalDevice physical, std::uint32_t queueFamily,
                             std::span<const char* const> extensions, bool wantsDensity)
    : extensions_(requiredDeviceExtensions()) {
  extensions_.insert(extensions_.end(), extensions.begin(), extensions.end());
  if (wantsDensity) extensions_.push_back(VK_EXT_FRAGMENT_DENSITY_MAP_EXTENSION_NAME);
  queue_ = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
            .pNext = nullptr,
            .flags = 0,
            .queueFamilyIndex = queueFamily,
            .queueCount = 1,
            .pQueuePriorities = &priority_};
  VkPhysicalDeviceFeatures available{};
  vkGetPhysicalDeviceFeatures(physical, &available);
  multiview_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
  multiview_.multiview = VK_TRUE;
  if (wantsDensity) multiview_.pNext = &density_;
  density_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FRAGMENT_DENSITY_MAP_FEATURES_EXT;
  density_.fragmentDensityMap = density_.fragmentDensityMapNonSubsampledImages = VK_TRUE;
  features_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  features_.pNext = &multiview_;
  features_.features.samplerAnisotropy = available.samplerAnisotropy;
  info_.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info_.pNext = &features_;
  info_.queueCreateInfoCount = 1;
  info_.pQueueCreateInfos = &queue_;
  info_.enabledExtensionCount = static_cast<std::uint32_t>(extensions_.size());
  info_.ppEnabledExtensionNames = extensions_.data();
}

std::uint64_t validationMessages() {
  return messages;
}

}  // namespace clothstream::xr
