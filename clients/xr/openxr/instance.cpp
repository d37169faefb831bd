// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/instance.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include <spdlog/spdlog.h>

namespace clothstream::xr {
namespace {

std::atomic<std::uint64_t> messages{0};

XrBool32 XRAPI_PTR logMessage(XrDebugUtilsMessageSeverityFlagsEXT severity,
                              XrDebugUtilsMessageTypeFlagsEXT types,
                              const XrDebugUtilsMessengerCallbackDataEXT* data, void*) {
  const bool isError = (severity & XR_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT) != 0;
  if ((types & XR_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT) != 0) {
    ++messages;
    spdlog::error("OpenXR validation: {}: {}", data->functionName ? data->functionName : "", data->message);
  } else {
    spdlog::log(isError ? spdlog::level::warn : spdlog::level::debug, "OpenXR: {}", data->message);
  }
  return XR_FALSE;
}

XrDebugUtilsMessengerCreateInfoEXT messengerInfo() {
  auto info = typed<XrDebugUtilsMessengerCreateInfoEXT>(XR_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT);
  info.messageSeverities =
      XR_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | XR_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageTypes =
      XR_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT | XR_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
      XR_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT | XR_DEBUG_UTILS_MESSAGE_TYPE_CONFORMANCE_BIT_EXT;
  info.userCallback = logMessage;
  return info;
}

// Throws the meaning of a failed start for the user.
[[noreturn]] void explain(XrResult result, const char* call) {
  const std::string name = nameOf(result);
  switch (result) {
    case XR_ERROR_RUNTIME_UNAVAILABLE:
    case XR_ERROR_FILE_ACCESS_ERROR:
    case XR_ERROR_FILE_CONTENTS_INVALID:
      throw XrError(
          result,
          "No OpenXR runtime is active (" + name +
              "). Start SteamVR, Monado or WiVRn and make it the active runtime, or set XR_RUNTIME_JSON to "
              "its manifest. --verbose shows what was tried. Without a headset, use --flat.");
    case XR_ERROR_RUNTIME_FAILURE:
    case XR_ERROR_INITIALIZATION_FAILED:
    case XR_ERROR_INSTANCE_LOST:
      throw XrError(result, "The OpenXR runtime does not answer (" + name +
                                "). Check that its service is running, such as monado-service.");
    case XR_ERROR_FORM_FACTOR_UNAVAILABLE:
    case XR_ERROR_FORM_FACTOR_UNSUPPORTED:
      throw XrError(result, "The OpenXR runtime has no headset (" + name + "). Connect it and switch it on.");
    default:
      throw XrError(result, std::string(call) + " failed: " + name);
  }
}

std::vector<std::string> availableExtensions() {
  std::uint32_t count = 0;
  if (const XrResult result = xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr);
      XR_FAILED(result))
    explain(result, "xrEnumerateInstanceExtensionProperties");
  std::vector<XrExtensionProperties> properties(count, {XR_TYPE_EXTENSION_PROPERTIES, nullptr, {}, 0});
  check(xrEnumerateInstanceExtensionProperties(nullptr, count, &count, properties.data()),
        "xrEnumerateInstanceExtensionProperties");
  std::vector<std::string> names;
  for (const XrExtensionProperties& each : properties) names.emplace_back(each.extensionName);
  return names;
}

}  // namespace

Instance::Instance() {
  const std::vector<std::string> available = availableExtensions();
  std::vector<const char*> used;
  const auto use = [&](const char* name) {
    const bool has = std::ranges::find(available, name) != available.end();
    if (has) used.push_back(name);
    return has;
  };
  // All of them, or none.
  const auto useAll = [&](std::initializer_list<const char*> names) {
    const std::size_t before = used.size();
    if (std::ranges::all_of(names, use)) return true;
    used.resize(before);
    return false;
  };
  if (!use(XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME))
    throw XrError(
        XR_ERROR_EXTENSION_NOT_PRESENT,
        "The OpenXR runtime lacks XR_KHR_vulkan_enable2. Use a runtime with Vulkan, or a newer one.");
  extensions_ = {.handTracking = use(XR_EXT_HAND_TRACKING_EXTENSION_NAME),
                 .handInteraction = use(kHandInteractionExtension),
                 .pico = use(kPicoExtension),
                 .localFloor = use(kLocalFloorExtension),
                 .depthLayer = use(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME),
                 .convertTime = use(XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME),
                 .passthrough = use(XR_FB_PASSTHROUGH_EXTENSION_NAME),
                 .refreshRate = use(XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME),
                 .foveation = useAll(
                     {XR_FB_SWAPCHAIN_UPDATE_STATE_EXTENSION_NAME, XR_FB_FOVEATION_EXTENSION_NAME,
                      XR_FB_FOVEATION_CONFIGURATION_EXTENSION_NAME, XR_FB_FOVEATION_VULKAN_EXTENSION_NAME}),
                 .debugUtils = use(XR_EXT_DEBUG_UTILS_EXTENSION_NAME)};
  auto info = typed<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
  const XrDebugUtilsMessengerCreateInfoEXT messenger = messengerInfo();
  if (extensions_.debugUtils) info.next = &messenger;
  std::strncpy(info.applicationInfo.applicationName, "ClothStream", XR_MAX_APPLICATION_NAME_SIZE - 1);
  std::strncpy(info.applicationInfo.engineName, "clothstream-xr", XR_MAX_ENGINE_NAME_SIZE - 1);
  info.applicationInfo.applicationVersion = info.applicationInfo.engineVersion = 1;
  info.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  info.enabledExtensionCount = static_cast<std::uint32_t>(used.size());
  info.enabledExtensionNames = used.data();
  if (const XrResult result = xrCreateInstance(&info, &instance_); XR_FAILED(result))
    explain(result, "xrCreateInstance");
  try {
    findSystem();
    if (extensions_.debugUtils)
      check(functionOf<PFN_xrCreateDebugUtilsMessengerEXT>(instance_, "xrCreateDebugUtilsMessengerEXT")(
                instance_, &messenger, &messenger_),
            "xrCreateDebugUtilsMessengerEXT");
  } catch (...) {
    xrDestroyInstance(instance_);
    throw;
  }
}

// Messengers end with their instance.
Instance::~Instance() {
  xrDestroyInstance(instance_);
}

void Instance::findSystem() {
  auto runtime = typed<XrInstanceProperties>(XR_TYPE_INSTANCE_PROPERTIES);
  check(xrGetInstanceProperties(instance_, &runtime), "xrGetInstanceProperties");
  runtimeName_ = std::string(runtime.runtimeName) + " " +
                 std::to_string(XR_VERSION_MAJOR(runtime.runtimeVersion)) + "." +
                 std::to_string(XR_VERSION_MINOR(runtime.runtimeVersion)) + "." +
                 std::to_string(XR_VERSION_PATCH(runtime.runtimeVersion));
  auto wanted = typed<XrSystemGetInfo>(XR_TYPE_SYSTEM_GET_INFO);
  wanted.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  if (const XrResult result = xrGetSystem(instance_, &wanted, &system_); XR_FAILED(result))
    explain(result, "xrGetSystem");
  auto hands = typed<XrSystemHandTrackingPropertiesEXT>(XR_TYPE_SYSTEM_HAND_TRACKING_PROPERTIES_EXT);
  auto passThrough = typed<XrSystemPassthroughPropertiesFB>(XR_TYPE_SYSTEM_PASSTHROUGH_PROPERTIES_FB);
  auto system = typed<XrSystemProperties>(XR_TYPE_SYSTEM_PROPERTIES);
  if (extensions_.handTracking) system.next = &hands;
  if (extensions_.passthrough) {
    passThrough.next = system.next;
    system.next = &passThrough;
  }
  check(xrGetSystemProperties(instance_, system_, &system), "xrGetSystemProperties");
  systemName_ = system.systemName;
  tracksHands_ = extensions_.handTracking && hands.supportsHandTracking == XR_TRUE;
  passesThrough_ = extensions_.passthrough && passThrough.supportsPassthrough == XR_TRUE;
}

XrPath Instance::path(const std::string& text) const {
  XrPath path = XR_NULL_PATH;
  check(xrStringToPath(instance_, text.c_str(), &path), "xrStringToPath");
  return path;
}

std::uint64_t openXrValidationMessages() {
  return messages;
}

}  // namespace clothstream::xr
