// SPDX-License-Identifier: MIT
// The headers of OpenXR with Vulkan, what older ones lack, and errors.
#pragma once

#include <ctime>
#include <stdexcept>
#include <string>

#include <volk.h>

#define XR_USE_GRAPHICS_API_VULKAN
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include "clients/xr/render/handle.h"  // check() of results of Vulkan

namespace clothstream::xr {

// The headers of Debian 12 are those of OpenXR 1.0.20, which lack these.
inline constexpr const char* kLocalFloorExtension = "XR_EXT_local_floor";
inline constexpr auto kLocalFloorSpace = static_cast<XrReferenceSpaceType>(1000426000);
inline constexpr const char* kHandInteractionExtension = "XR_EXT_hand_interaction";
inline constexpr const char* kHandInteractionProfile = "/interaction_profiles/ext/hand_interaction_ext";
inline constexpr const char* kPicoExtension = "XR_BD_controller_interaction";

// A call of OpenXR that failed.
class XrError : public std::runtime_error {
 public:
  XrError(XrResult result, const std::string& text) : std::runtime_error(text), result_(result) {}
  XrResult result() const { return result_; }

 private:
  XrResult result_;
};

// Name of a result, such as "XR_ERROR_RUNTIME_FAILURE".
std::string nameOf(XrResult result);
// Name of a session state, such as "FOCUSED".
const char* nameOf(XrSessionState state);

// Throws an XrError that names the call unless it succeeded. Returns the result, which may be a success other
// than XR_SUCCESS.
XrResult check(XrResult result, const char* call);

// A structure of OpenXR whose other members are 0.
template <typename Structure>
Structure typed(XrStructureType type) {
  Structure structure{};
  structure.type = type;
  return structure;
}

// Address of a function of an extension. Throws an XrError if the runtime lacks it.
template <typename Function>
Function functionOf(XrInstance instance, const char* name) {
  PFN_xrVoidFunction function = nullptr;
  check(xrGetInstanceProcAddr(instance, name, &function), name);
  return reinterpret_cast<Function>(function);
}

}  // namespace clothstream::xr
