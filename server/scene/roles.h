// SPDX-License-Identifier: MIT
// Roles of participants, and what each may do.
#pragma once

#include <cstdint>

#include "server/delivery/wire_types.h"
#include "server/messages/field_error.h"

namespace clothstream::scene {

// Rights grow in this order. The values are those of v1::Role.
enum class Role : std::uint8_t { none, viewer, participant, owner };

enum class Action : std::uint8_t {
  collide,
  grab,
  moveAttachments,
  wear,  // a body
  holdWinds,
  placeSurfaces,  // of the real room
  changeEnvironment,
  changeCloths,
  changeColliders,  // the scene's own colliders
  controlScene,
  deleteScene,
  recordScene,
  setRole,
  removeParticipant,
  createScene,
  manageBans,
};

// Rights of the role participant in addition to colliders, grabs and attachments. Owners have all of them.
struct Permissions {
  // Parameters that they may change. `environment` also lets them hold winds.
  bool environment = true, cloths = true, colliders = true;
  bool create = false, remove = false;  // scenes
  bool control = false, record = false;
  bool own = false;  // become the owner of a scene that has none, by joining first
};

// Lowest role that may do this.
Role roleFor(Action action, const Permissions& participants);

Role fromMessage(v1::Role role);
v1::Role toMessage(Role role);

// Name for people, such as "viewer".
const char* nameOf(Role role);

// Returns PERMISSION_DENIED, with the action and the required role, if the role is too low.
[[nodiscard]] messages::Result<void> permit(Role role, Action action, const Permissions& participants);
// Poses without colliders, grabs, attachments and winds need no role: they only ask for contact events.
[[nodiscard]] messages::Result<void> permit(Role role, const v1::ColliderPoses& message,
                                            const Permissions& participants);
[[nodiscard]] messages::Result<void> permit(Role role, const v1::ParameterChange& message,
                                            const Permissions& participants);

}  // namespace clothstream::scene
