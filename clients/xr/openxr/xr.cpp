// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/xr.h"

#include <openxr/openxr_reflection.h>

namespace clothstream::xr {

std::string nameOf(XrResult result) {
  switch (result) {
#define CLOTHSTREAM_NAME(name, value) \
  case name:                          \
    return #name;
    XR_LIST_ENUM_XrResult(CLOTHSTREAM_NAME)
#undef CLOTHSTREAM_NAME
        default : break;
  }
  return "XrResult " + std::to_string(static_cast<int>(result));
}

const char* nameOf(XrSessionState state) {
  switch (state) {
    case XR_SESSION_STATE_IDLE:
      return "IDLE";
    case XR_SESSION_STATE_READY:
      return "READY";
    case XR_SESSION_STATE_SYNCHRONIZED:
      return "SYNCHRONIZED";
    case XR_SESSION_STATE_VISIBLE:
      return "VISIBLE";
    case XR_SESSION_STATE_FOCUSED:
      return "FOCUSED";
    case XR_SESSION_STATE_STOPPING:
      return "STOPPING";
    case XR_SESSION_STATE_LOSS_PENDING:
      return "LOSS_PENDING";
    case XR_SESSION_STATE_EXITING:
      return "EXITING";
    default:
      return "UNKNOWN";
  }
}

XrResult check(XrResult result, const char* call) {
  if (XR_FAILED(result)) throw XrError(result, std::string(call) + " failed: " + nameOf(result));
  return result;
}

}  // namespace clothstream::xr
