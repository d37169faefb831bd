// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/room_space.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <spdlog/spdlog.h>

#include "clients/xr/openxr/actions.h"

namespace clothstream::xr {

RoomSpace::RoomSpace(const Instance& instance, XrSession session) : session_(session) {
  std::uint32_t count = 0;
  check(xrEnumerateReferenceSpaces(session, 0, &count, nullptr), "xrEnumerateReferenceSpaces");
  std::vector<XrReferenceSpaceType> types(count);
  check(xrEnumerateReferenceSpaces(session, count, &count, types.data()), "xrEnumerateReferenceSpaces");
  const auto has = [&](XrReferenceSpaceType type) { return std::ranges::find(types, type) != types.end(); };
  make(XR_REFERENCE_SPACE_TYPE_VIEW, 0, view_);
  if (instance.extensions().localFloor && has(kLocalFloorSpace)) {
    make(kLocalFloorSpace, 0, room_);
    spdlog::info("The floor is that of LOCAL_FLOOR");
    return;
  }
  make(XR_REFERENCE_SPACE_TYPE_LOCAL, -kEyes, room_);
  if (!has(XR_REFERENCE_SPACE_TYPE_STAGE)) {
    spdlog::info("The runtime knows no floor: it is assumed {} m below the eyes", kEyes);
    return;
  }
  make(XR_REFERENCE_SPACE_TYPE_LOCAL, 0, local_);
  make(XR_REFERENCE_SPACE_TYPE_STAGE, 0, stage_);
  findsFloor_ = true;
  spdlog::info("The floor is that of STAGE");
}

RoomSpace::~RoomSpace() {
  for (const XrSpace space : {room_, view_, local_, stage_})
    if (space != XR_NULL_HANDLE) xrDestroySpace(space);
}

void RoomSpace::update(XrTime time) {
  Pose floor;
  if (!findsFloor_ || !locate(stage_, local_, time, floor) || !std::isfinite(floor.position.y())) return;
  findsFloor_ = false;
  xrDestroySpace(std::exchange(room_, XR_NULL_HANDLE));
  make(XR_REFERENCE_SPACE_TYPE_LOCAL, floor.position.y(), room_);
}

void RoomSpace::make(XrReferenceSpaceType type, float height, XrSpace& space) {
  auto info = typed<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
  info.referenceSpaceType = type;
  info.poseInReferenceSpace = xrPoseOf({{0, height, 0}, Eigen::Quaternionf::Identity()});
  check(xrCreateReferenceSpace(session_, &info, &space), "xrCreateReferenceSpace");
}

}  // namespace clothstream::xr
