// SPDX-License-Identifier: MIT
#include "server/scene/roles.h"

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/messages/parameter_numbers.h"

namespace clothstream::scene {
namespace {

// Fields of the message, in the JSON form that all errors use.
const char* nameOf(Action action) {
  switch (action) {
    case Action::collide:
      return "colliderPoses.colliders";
    case Action::grab:
      return "colliderPoses.grabs";
    case Action::moveAttachments:
      return "colliderPoses: attachments and joints";
    case Action::wear:
      return "wearBody";
    case Action::holdWinds:
      return "colliderPoses.winds";
    case Action::placeSurfaces:
      return "surface";
    case Action::changeEnvironment:
      return "parameterChange: the environment";
    case Action::changeCloths:
      return "parameterChange.cloths";
    case Action::changeColliders:
      return "parameterChange.colliders";
    case Action::controlScene:
      return "controlScene";
    case Action::deleteScene:
      return "deleteScene";
    case Action::recordScene:
      return "startRecording, stopRecording";
    case Action::setRole:
      return "setRole";
    case Action::removeParticipant:
      return "removeParticipant";
    case Action::createScene:
      return "createScene";
    case Action::manageBans:
      return "listBans, liftBan";
  }
  return "";
}

}  // namespace

Role roleFor(Action action, const Permissions& participants) {
  const auto lowest = [](bool byParticipants) { return byParticipants ? Role::participant : Role::owner; };
  switch (action) {
    case Action::collide:
    case Action::grab:
    case Action::moveAttachments:
    case Action::wear:
    case Action::placeSurfaces:
      return Role::participant;
    case Action::holdWinds:
    case Action::changeEnvironment:
      return lowest(participants.environment);
    case Action::changeCloths:
      return lowest(participants.cloths);
    case Action::changeColliders:
      return lowest(participants.colliders);
    case Action::controlScene:
      return lowest(participants.control);
    case Action::deleteScene:
      return lowest(participants.remove);
    case Action::recordScene:
      return lowest(participants.record);
    case Action::createScene:
      return lowest(participants.create);
    case Action::setRole:
    case Action::removeParticipant:
    case Action::manageBans:
      return Role::owner;
  }
  return Role::owner;
}

Role fromMessage(v1::Role role) {
  switch (role) {
    case v1::ROLE_VIEWER:
      return Role::viewer;
    case v1::ROLE_PARTICIPANT:
      return Role::participant;
    case v1::ROLE_OWNER:
      return Role::owner;
    default:
      return Role::none;
  }
}

v1::Role toMessage(Role role) {
  return static_cast<v1::Role>(role);
}

const char* nameOf(Role role) {
  switch (role) {
    case Role::viewer:
      return "viewer";
    case Role::participant:
      return "participant";
    case Role::owner:
      return "owner";
    case Role::none:
      break;
  }
  return "none";
}

messages::Result<void> permit(Role role, Action action, const Permissions& participants) {
  const Role needed = roleFor(action, participants);
  if (role >= needed) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_PERMISSION_DENIED,
      fmt::format("{}: requires the role {}; yours is {}", nameOf(action), nameOf(needed), nameOf(role))});
}

messages::Result<void> permit(Role role, const v1::ColliderPoses& message, const Permissions& participants) {
  messages::Result<void> permitted;
  if (!message.colliders().empty() || !message.hands().empty())
    permitted = permit(role, Action::collide, participants);
  if (permitted && !message.grabs().empty()) permitted = permit(role, Action::grab, participants);
  if (permitted && (!message.attachments().empty() || !message.joints().empty()))
    permitted = permit(role, Action::moveAttachments, participants);
  if (permitted && !message.winds().empty()) permitted = permit(role, Action::holdWinds, participants);
  return permitted;
}

messages::Result<void> permit(Role role, const v1::ParameterChange& message,
                              const Permissions& participants) {
  messages::Result<void> permitted;
  if (!message.cloths().empty()) permitted = permit(role, Action::changeCloths, participants);
  if (permitted && !message.colliders().empty())
    permitted = permit(role, Action::changeColliders, participants);
  // An empty change is announced to all subscribers as well.
  const bool nothing = message.cloths().empty() && message.colliders().empty();
  if (permitted && (messages::changesEnvironment(message) || nothing))
    permitted = permit(role, Action::changeEnvironment, participants);
  return permitted;
}

}  // namespace clothstream::scene
