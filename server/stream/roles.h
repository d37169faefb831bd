// SPDX-License-Identifier: MIT
// What each role may do.
#pragma once

#include <cstdint>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"

namespace clothstream::stream {

enum class Act : std::uint8_t {
  collide,
  grab,
  moveAttachments,
  changeEnvironment,
  changeCloths,
  changeColliders,  // the scene's
  controlScene,
  deleteScene,
  recordScene,
  setRole,
  removeParticipant,
};

// Which parameters of a scene change for those who are in it without owning it; owners change all.
struct Permissions {
  bool environment = true, cloths = true, colliders = true;
};

// The least that it takes.
v1::Role roleFor(Act act, const Permissions& participants);

// As people read it: "viewer", ...
const char* nameOf(v1::Role role);

// PERMISSION_DENIED, with what was asked and the role that it takes.
[[nodiscard]] messages::Result<void> permit(v1::Role role, Act act, const Permissions& participants);
// Poses of nothing, which only say what their sender wants to be told, take no role.
[[nodiscard]] messages::Result<void> permit(v1::Role role, const v1::ColliderPoses& message,
                                            const Permissions& participants);
[[nodiscard]] messages::Result<void> permit(v1::Role role, const v1::ParameterChange& message,
                                            const Permissions& participants);

}  // namespace clothstream::stream
