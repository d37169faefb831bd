// SPDX-License-Identifier: MIT
// Connection to an OpenXR runtime, and the extensions that it has.
#pragma once

#include <string>
#include <vector>

#include "clients/xr/openxr/xr.h"

namespace clothstream::xr {

// Extensions that are used where the runtime has them.
struct Extensions {
  bool handTracking = false;
  bool handInteraction = false;  // a profile of hands, with pinch and grasp
  bool pico = false;             // profiles of Pico's controllers
  bool localFloor = false;
  bool depthLayer = false;
  bool convertTime = false;  // XrTime to CLOCK_MONOTONIC
  bool passthrough = false;  // XR_FB_passthrough
  bool refreshRate = false;  // XR_FB_display_refresh_rate
  bool foveation = false;    // XR_FB_foveation with levels and Vulkan
  bool debugUtils = false;
};

class Instance {
 public:
  // Throws an XrError whose text says what to do: no runtime, one that does not answer, no headset, or a
  // runtime without XR_KHR_vulkan_enable2.
  Instance();
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  XrInstance get() const { return instance_; }
  XrSystemId system() const { return system_; }
  const Extensions& extensions() const { return extensions_; }
  // Name and version of the runtime, and name of the headset.
  const std::string& runtimeName() const { return runtimeName_; }
  const std::string& systemName() const { return systemName_; }
  // Whether the headset tracks hands, and has XR_FB_passthrough.
  bool tracksHands() const { return tracksHands_; }
  bool passesThrough() const { return passesThrough_; }

  XrPath path(const std::string& text) const;

 private:
  void findSystem();

  XrInstance instance_ = XR_NULL_HANDLE;
  XrDebugUtilsMessengerEXT messenger_ = XR_NULL_HANDLE;
  XrSystemId system_ = XR_NULL_SYSTEM_ID;
  Extensions extensions_;
  std::string runtimeName_, systemName_;
  bool tracksHands_ = false, passesThrough_ = false;
};

// Number of messages of validation layers of OpenXR in this process; they are also logged as errors.
std::uint64_t openXrValidationMessages();

}  // namespace clothstream::xr
