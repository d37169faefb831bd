// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/hand_trackers.h"

#include <spdlog/spdlog.h>

#include "clients/xr/openxr/actions.h"

namespace clothstream::xr {

static_assert(hands::kJoints == XR_HAND_JOINT_COUNT_EXT);

HandTrackers::HandTrackers(const Instance& instance, XrSession session) {
  if (!instance.tracksHands()) return;
  const auto create = functionOf<PFN_xrCreateHandTrackerEXT>(instance.get(), "xrCreateHandTrackerEXT");
  locate_ = functionOf<PFN_xrLocateHandJointsEXT>(instance.get(), "xrLocateHandJointsEXT");
  destroy_ = functionOf<PFN_xrDestroyHandTrackerEXT>(instance.get(), "xrDestroyHandTrackerEXT");
  for (std::size_t side = 0; side < kSides; ++side) {
    auto info = typed<XrHandTrackerCreateInfoEXT>(XR_TYPE_HAND_TRACKER_CREATE_INFO_EXT);
    info.hand = side == indexOf(Side::left) ? XR_HAND_LEFT_EXT : XR_HAND_RIGHT_EXT;
    info.handJointSet = XR_HAND_JOINT_SET_DEFAULT_EXT;
    const XrResult result = create(session, &info, &trackers_[side]);
    if (XR_SUCCEEDED(result)) continue;
    // The user may have refused it.
    trackers_[side] = XR_NULL_HANDLE;
    spdlog::warn("The runtime refuses to track the {} hand: {}", side == 0 ? "left" : "right",
                 nameOf(result));
  }
}

HandTrackers::~HandTrackers() {
  for (const XrHandTrackerEXT tracker : trackers_)
    if (tracker != XR_NULL_HANDLE) destroy_(tracker);
}

void HandTrackers::read(XrSpace room, XrTime time, std::array<LimbSample, kSides>& limbs) const {
  for (std::size_t side = 0; side < kSides; ++side)
    limbs[side].hasHand = readOne(side, room, time, limbs[side]);
}

bool HandTrackers::readOne(std::size_t side, XrSpace room, XrTime time, LimbSample& limb) const {
  if (trackers_[side] == XR_NULL_HANDLE) return false;
  std::array<XrHandJointLocationEXT, hands::kJoints> found{};
  auto info = typed<XrHandJointsLocateInfoEXT>(XR_TYPE_HAND_JOINTS_LOCATE_INFO_EXT);
  info.baseSpace = room;
  info.time = time;
  auto locations = typed<XrHandJointLocationsEXT>(XR_TYPE_HAND_JOINT_LOCATIONS_EXT);
  locations.jointCount = static_cast<std::uint32_t>(found.size());
  locations.jointLocations = found.data();
  check(locate_(trackers_[side], &info, &locations), "xrLocateHandJointsEXT");
  if (locations.isActive != XR_TRUE) return false;
  constexpr XrSpaceLocationFlags kBoth =
      XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if ((found[i].locationFlags & kBoth) != kBoth) return false;
    limb.joints[i] = {poseOf(found[i].pose).position, found[i].radius};
  }
  limb.wrist = poseOf(found[hands::kWrist].pose).orientation;
  return true;
}

}  // namespace clothstream::xr
