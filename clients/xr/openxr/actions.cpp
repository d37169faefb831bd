// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/actions.h"

#include <cstring>
#include <vector>

#include <spdlog/spdlog.h>

namespace clothstream::xr {
namespace {

constexpr std::array<const char*, kSides> kUsers{"/user/hand/left", "/user/hand/right"};

// Where a profile has what the actions need, after /user/hand/SIDE. Null: it does not have it.
struct Profile {
  const char* path;
  const char* trigger;
  const char* squeeze;
  std::array<const char*, kSides> recenter;
  bool vibrates;
};
constexpr Profile kSimple{"/interaction_profiles/khr/simple_controller",
                          "/input/select/click",
                          nullptr,
                          {"/input/menu/click", "/input/menu/click"},
                          true};
constexpr std::array<Profile, 4> kProfiles{{
    {"/interaction_profiles/oculus/touch_controller",
     "/input/trigger/value",
     "/input/squeeze/value",
     {"/input/menu/click", nullptr},
     true},
    {"/interaction_profiles/valve/index_controller",
     "/input/trigger/value",
     "/input/squeeze/value",
     {"/input/b/click", "/input/b/click"},
     true},
    {"/interaction_profiles/htc/vive_controller",
     "/input/trigger/value",
     "/input/squeeze/click",
     {"/input/menu/click", "/input/menu/click"},
     true},
    {"/interaction_profiles/microsoft/motion_controller",
     "/input/trigger/value",
     "/input/squeeze/click",
     {"/input/menu/click", "/input/menu/click"},
     true},
}};
constexpr Profile kPico{"/interaction_profiles/bytedance/pico4_controller",
                        "/input/trigger/value",
                        "/input/squeeze/value",
                        {"/input/menu/click", nullptr},
                        true};
constexpr Profile kHand{
    kHandInteractionProfile, "/input/pinch_ext/value", "/input/grasp_ext/value", {nullptr, nullptr}, false};

}  // namespace

Pose poseOf(const XrPosef& pose) {
  const auto& [x, y, z, w] = pose.orientation;
  return {{pose.position.x, pose.position.y, pose.position.z}, Eigen::Quaternionf(w, x, y, z)};
}

XrPosef xrPoseOf(const Pose& pose) {
  const Eigen::Quaternionf& turn = pose.orientation;
  return {{turn.x(), turn.y(), turn.z(), turn.w()},
          {pose.position.x(), pose.position.y(), pose.position.z()}};
}

bool locate(XrSpace space, XrSpace base, XrTime time, Pose& out) {
  auto location = typed<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION);
  check(xrLocateSpace(space, base, time, &location), "xrLocateSpace");
  constexpr XrSpaceLocationFlags kBoth =
      XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
  if ((location.locationFlags & kBoth) != kBoth) return false;
  out = poseOf(location.pose);
  return true;
}

Actions::Actions(const Instance& instance, XrSession session) : instance_(instance), session_(session) {
  for (std::size_t side = 0; side < kSides; ++side) paths_[side] = instance.path(kUsers[side]);
  auto info = typed<XrActionSetCreateInfo>(XR_TYPE_ACTION_SET_CREATE_INFO);
  std::strncpy(info.actionSetName, "touch", XR_MAX_ACTION_SET_NAME_SIZE - 1);
  std::strncpy(info.localizedActionSetName, "Touch the cloth", XR_MAX_LOCALIZED_ACTION_SET_NAME_SIZE - 1);
  check(xrCreateActionSet(instance.get(), &info, &set_), "xrCreateActionSet");
  grip_ = make("grip", "Place of the hand", XR_ACTION_TYPE_POSE_INPUT);
  aim_ = make("aim", "Point", XR_ACTION_TYPE_POSE_INPUT);
  trigger_ = make("press", "Press a button or grab", XR_ACTION_TYPE_FLOAT_INPUT);
  squeeze_ = make("squeeze", "Grab cloth", XR_ACTION_TYPE_FLOAT_INPUT);
  recenter_ = make("recenter", "Place the scene before me", XR_ACTION_TYPE_BOOLEAN_INPUT);
  haptic_ = make("vibrate", "Feel the cloth", XR_ACTION_TYPE_VIBRATION_OUTPUT);
  suggest();
  auto attach = typed<XrSessionActionSetsAttachInfo>(XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO);
  attach.countActionSets = 1;
  attach.actionSets = &set_;
  check(xrAttachSessionActionSets(session, &attach), "xrAttachSessionActionSets");
  for (std::size_t side = 0; side < kSides; ++side) {
    auto space = typed<XrActionSpaceCreateInfo>(XR_TYPE_ACTION_SPACE_CREATE_INFO);
    space.subactionPath = paths_[side];
    space.poseInActionSpace = xrPoseOf({});
    space.action = grip_;
    check(xrCreateActionSpace(session, &space, &gripSpaces_[side]), "xrCreateActionSpace");
    space.action = aim_;
    check(xrCreateActionSpace(session, &space, &aimSpaces_[side]), "xrCreateActionSpace");
  }
}

// The spaces end with the session, and the actions with the set.
Actions::~Actions() {
  xrDestroyActionSet(set_);
}

XrAction Actions::make(const char* name, const char* text, XrActionType type) {
  auto info = typed<XrActionCreateInfo>(XR_TYPE_ACTION_CREATE_INFO);
  info.actionType = type;
  std::strncpy(info.actionName, name, XR_MAX_ACTION_NAME_SIZE - 1);
  std::strncpy(info.localizedActionName, text, XR_MAX_LOCALIZED_ACTION_NAME_SIZE - 1);
  info.countSubactionPaths = kSides;
  info.subactionPaths = paths_.data();
  XrAction action = XR_NULL_HANDLE;
  check(xrCreateAction(set_, &info, &action), "xrCreateAction");
  return action;
}

void Actions::suggest() {
  std::vector<Profile> profiles(kProfiles.begin(), kProfiles.end());
  profiles.push_back(kSimple);
  if (instance_.extensions().pico) profiles.push_back(kPico);
  if (instance_.extensions().handInteraction) profiles.push_back(kHand);
  for (const Profile& profile : profiles) {
    std::vector<XrActionSuggestedBinding> bindings;
    for (std::size_t side = 0; side < kSides; ++side) {
      const auto bind = [&](XrAction action, const char* input) {
        if (input) bindings.push_back({action, instance_.path(std::string(kUsers[side]) + input)});
      };
      bind(grip_, "/input/grip/pose");
      bind(aim_, "/input/aim/pose");
      bind(trigger_, profile.trigger);
      bind(squeeze_, profile.squeeze);
      bind(recenter_, profile.recenter[side]);
      bind(haptic_, profile.vibrates ? "/output/haptic" : nullptr);
    }
    auto suggestion =
        typed<XrInteractionProfileSuggestedBinding>(XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING);
    suggestion.interactionProfile = instance_.path(profile.path);
    suggestion.countSuggestedBindings = static_cast<std::uint32_t>(bindings.size());
    suggestion.suggestedBindings = bindings.data();
    const XrResult result = xrSuggestInteractionProfileBindings(instance_.get(), &suggestion);
    // A runtime may lack a profile that the standard has. Its own controllers then use another one.
    if (result == XR_ERROR_PATH_UNSUPPORTED) {
      spdlog::info("The runtime does not know {}", profile.path);
    } else {
      check(result, "xrSuggestInteractionProfileBindings");
    }
  }
}

void Actions::read(XrSpace room, XrTime time, std::array<LimbSample, kSides>& limbs) {
  for (LimbSample& limb : limbs) limb.hasController = limb.hasAim = false;
  recenters_ = false;
  const XrActiveActionSet active{set_, XR_NULL_PATH};
  auto sync = typed<XrActionsSyncInfo>(XR_TYPE_ACTIONS_SYNC_INFO);
  sync.countActiveActionSets = 1;
  sync.activeActionSets = &active;
  if (check(xrSyncActions(session_, &sync), "xrSyncActions") == XR_SESSION_NOT_FOCUSED) return;
  for (std::size_t side = 0; side < kSides; ++side) {
    LimbSample& limb = limbs[side];
    auto get = typed<XrActionStateGetInfo>(XR_TYPE_ACTION_STATE_GET_INFO);
    get.subactionPath = paths_[side];
    get.action = grip_;
    auto pose = typed<XrActionStatePose>(XR_TYPE_ACTION_STATE_POSE);
    check(xrGetActionStatePose(session_, &get, &pose), "xrGetActionStatePose");
    // Hands have a profile with poses as well; they are read by their joints. Without joints, a hand is a
    // controller whose trigger is the pinch.
    if (pose.isActive == XR_TRUE && !isHandProfile_[side])
      limb.hasController = locate(gripSpaces_[side], room, time, limb.grip);
    get.action = aim_;
    check(xrGetActionStatePose(session_, &get, &pose), "xrGetActionStatePose");
    if (pose.isActive == XR_TRUE) limb.hasAim = locate(aimSpaces_[side], room, time, limb.aim);
    limb.trigger = valueOf(trigger_, side);
    limb.squeeze = valueOf(squeeze_, side);
    get.action = recenter_;
    auto button = typed<XrActionStateBoolean>(XR_TYPE_ACTION_STATE_BOOLEAN);
    check(xrGetActionStateBoolean(session_, &get, &button), "xrGetActionStateBoolean");
    recenters_ |= button.isActive == XR_TRUE && button.changedSinceLastSync == XR_TRUE &&
                  button.currentState == XR_TRUE;
  }
}

float Actions::valueOf(XrAction action, std::size_t side) const {
  auto get = typed<XrActionStateGetInfo>(XR_TYPE_ACTION_STATE_GET_INFO);
  get.subactionPath = paths_[side];
  get.action = action;
  auto state = typed<XrActionStateFloat>(XR_TYPE_ACTION_STATE_FLOAT);
  check(xrGetActionStateFloat(session_, &get, &state), "xrGetActionStateFloat");
  return state.isActive == XR_TRUE ? state.currentState : 0;
}

void Actions::profilesChanged() {
  for (std::size_t side = 0; side < kSides; ++side) {
    auto state = typed<XrInteractionProfileState>(XR_TYPE_INTERACTION_PROFILE_STATE);
    check(xrGetCurrentInteractionProfile(session_, paths_[side], &state), "xrGetCurrentInteractionProfile");
    std::array<char, XR_MAX_PATH_LENGTH> name{};
    std::uint32_t length = 0;
    if (state.interactionProfile != XR_NULL_PATH)
      check(
          xrPathToString(instance_.get(), state.interactionProfile, XR_MAX_PATH_LENGTH, &length, name.data()),
          "xrPathToString");
    isHandProfile_[side] = instance_.tracksHands() && std::strcmp(name.data(), kHandInteractionProfile) == 0;
    spdlog::info("{} uses {}", side == 0 ? "The left hand" : "The right hand",
                 length > 0 ? name.data() : "nothing");
  }
}

void Actions::vibrate(const Pulse& pulse) {
  auto info = typed<XrHapticActionInfo>(XR_TYPE_HAPTIC_ACTION_INFO);
  info.action = haptic_;
  info.subactionPath = paths_[indexOf(pulse.side)];
  auto vibration = typed<XrHapticVibration>(XR_TYPE_HAPTIC_VIBRATION);
  vibration.amplitude = pulse.amplitude;
  vibration.duration = static_cast<XrDuration>(static_cast<double>(pulse.seconds) * 1e9);
  vibration.frequency = XR_FREQUENCY_UNSPECIFIED;
  check(xrApplyHapticFeedback(session_, &info, reinterpret_cast<const XrHapticBaseHeader*>(&vibration)),
        "xrApplyHapticFeedback");
}

}  // namespace clothstream::xr
