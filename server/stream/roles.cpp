// SPDX-License-Identifier: MIT
// What each role may do.
#include "server/stream/roles.h"

#include <fmt/format.h>

namespace clothstream::stream {
namespace {

// As the names of fields in errors are: those of the JSON form.
const char* nameOf(Act act) {
  switch (act) {
    case Act::collide:
      return "colliderPoses.colliders";
    case Act::grab:
      return "colliderPoses.grabs";
    case Act::moveAttachments:
      return "colliderPoses.attachments";
    case Act::changeEnvironment:
      return "parameterChange: gravity, wind, gust and airDensity";
    case Act::changeCloths:
      return "parameterChange.cloths";
    case Act::changeColliders:
      return "parameterChange.colliders";
    case Act::controlScene:
      return "controlScene";
    case Act::deleteScene:
      return "deleteScene";
    case Act::recordScene:
      return "startRecording, stopRecording";
    case Act::setRole:
      return "setRole";
    case Act::removeParticipant:
      return "removeParticipant";
  }
  return "";
}

}  // namespace

v1::Role roleFor(Act act, const Permissions& participants) {
  const auto changed = [](bool byParticipants) {
    return byParticipants ? v1::ROLE_PARTICIPANT : v1::ROLE_OWNER;
  };
  switch (act) {
    case Act::collide:
    case Act::grab:
    case Act::moveAttachments:
      return v1::ROLE_PARTICIPANT;
    case Act::changeEnvironment:
      return changed(participants.environment);
    case Act::changeCloths:
      return changed(participants.cloths);
    case Act::changeColliders:
      return changed(participants.colliders);
    case Act::controlScene:
    case Act::deleteScene:
    case Act::recordScene:
    case Act::setRole:
    case Act::removeParticipant:
      return v1::ROLE_OWNER;
  }
  return v1::ROLE_OWNER;
}

const char* nameOf(v1::Role role) {
  switch (role) {
    case v1::ROLE_VIEWER:
      return "viewer";
    case v1::ROLE_PARTICIPANT:
      return "participant";
    case v1::ROLE_OWNER:
      return "owner";
    default:
      return "none";
  }
}

messages::Result<void> permit(v1::Role role, Act act, const Permissions& participants) {
  const v1::Role needed = roleFor(act, participants);
  if (role >= needed) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_PERMISSION_DENIED,
      fmt::format("{}: takes the role {}; yours is {}", nameOf(act), nameOf(needed), nameOf(role))});
}

messages::Result<void> permit(v1::Role role, const v1::ColliderPoses& message,
                              const Permissions& participants) {
  messages::Result<void> permitted;
  if (!message.colliders().empty() || !message.hands().empty())
    permitted = permit(role, Act::collide, participants);
  if (permitted && !message.grabs().empty()) permitted = permit(role, Act::grab, participants);
  if (permitted && !message.attachments().empty())
    permitted = permit(role, Act::moveAttachments, participants);
  return permitted;
}

messages::Result<void> permit(v1::Role role, const v1::ParameterChange& message,
                              const Permissions& participants) {
  messages::Result<void> permitted;
  if (!message.cloths().empty()) permitted = permit(role, Act::changeCloths, participants);
  if (permitted && !message.colliders().empty()) permitted = permit(role, Act::changeColliders, participants);
  const bool environment =
      message.has_gravity() || message.has_wind() || message.has_air_density() || message.has_gust();
  // A change of nothing is told to everybody too.
  const bool nothing = message.cloths().empty() && message.colliders().empty();
  if (permitted && (environment || nothing)) permitted = permit(role, Act::changeEnvironment, participants);
  return permitted;
}

}  // namespace clothstream::stream
