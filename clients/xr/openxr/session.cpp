// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/session.h"

#include <algorithm>

#include <spdlog/spdlog.h>

namespace clothstream::xr {
namespace {

void readSpaceChange(const XrEventDataReferenceSpaceChangePending& event, SessionChanges& changes) {
  const bool isStage = event.referenceSpaceType == XR_REFERENCE_SPACE_TYPE_STAGE;
  const bool isOrigin = event.referenceSpaceType == XR_REFERENCE_SPACE_TYPE_LOCAL ||
                        event.referenceSpaceType == kLocalFloorSpace;
  if (!isStage && !isOrigin) return;
  std::optional<XrTime>& moves = isStage ? changes.floorMoves : changes.originMoves;
  moves = std::max(event.changeTime, moves.value_or(event.changeTime));
}

}  // namespace

Session::Session(const Instance& instance, const Graphics& graphics) : instance_(instance.get()) {
  const XrGraphicsBindingVulkan2KHR binding = graphics.binding();
  auto info = typed<XrSessionCreateInfo>(XR_TYPE_SESSION_CREATE_INFO);
  info.next = &binding;
  info.systemId = instance.system();
  check(xrCreateSession(instance_, &info, &session_), "xrCreateSession");
}

Session::~Session() {
  xrDestroySession(session_);
}

SessionChanges Session::poll() {
  SessionChanges changes;
  while (true) {
    auto buffer = typed<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
    if (check(xrPollEvent(instance_, &buffer), "xrPollEvent") == XR_EVENT_UNAVAILABLE) return changes;
    switch (buffer.type) {
      case XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING:
        spdlog::warn("The OpenXR runtime ends");
        changes.restarts = true;
        return changes;
      case XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED:
        changeState(reinterpret_cast<const XrEventDataSessionStateChanged&>(buffer).state, changes);
        break;
      case XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING:
        readSpaceChange(reinterpret_cast<const XrEventDataReferenceSpaceChangePending&>(buffer), changes);
        break;
      case XR_TYPE_EVENT_DATA_INTERACTION_PROFILE_CHANGED:
        changes.profilesChanged = true;
        break;
      case XR_TYPE_EVENT_DATA_DISPLAY_REFRESH_RATE_CHANGED_FB: {
        const auto& rate = reinterpret_cast<const XrEventDataDisplayRefreshRateChangedFB&>(buffer);
        spdlog::info("The headset shows {} Hz now, before {} Hz", rate.toDisplayRefreshRate,
                     rate.fromDisplayRefreshRate);
        break;
      }
      case XR_TYPE_EVENT_DATA_EVENTS_LOST:
        spdlog::warn("The OpenXR runtime has lost {} events",
                     reinterpret_cast<const XrEventDataEventsLost&>(buffer).lostEventCount);
        // A state that is lost is noticed by the next call that it forbids, which ends in a new session.
        changes.profilesChanged = true;
        break;
      default:
        break;
    }
  }
}

void Session::changeState(XrSessionState state, SessionChanges& changes) {
  state_ = state;
  spdlog::info("The session is {}", nameOf(state));
  switch (state) {
    case XR_SESSION_STATE_READY: {
      auto info = typed<XrSessionBeginInfo>(XR_TYPE_SESSION_BEGIN_INFO);
      info.primaryViewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
      check(xrBeginSession(session_, &info), "xrBeginSession");
      isRunning_ = true;
      break;
    }
    case XR_SESSION_STATE_STOPPING:
      isRunning_ = false;
      check(xrEndSession(session_), "xrEndSession");
      break;
    case XR_SESSION_STATE_LOSS_PENDING:
      isRunning_ = false;
      changes.restarts = true;
      break;
    case XR_SESSION_STATE_EXITING:
      isRunning_ = false;
      changes.exits = true;
      break;
    default:
      break;
  }
}

bool Session::requestExit() {
  if (!isRunning_) return false;
  const XrResult result = xrRequestExitSession(session_);
  if (XR_FAILED(result)) spdlog::warn("xrRequestExitSession failed: {}", nameOf(result));
  return XR_SUCCEEDED(result);
}

}  // namespace clothstream::xr
