// SPDX-License-Identifier: MIT
// Requests of the program: input, changes, roles, play-out.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "clients/core/client.h"
#include "clients/core/touch/pick.h"

namespace clothstream::client {

void Client::setColliders(std::span<const cs_own_collider> colliders, std::uint64_t nowUs) {
  poses_.colliders.assign(colliders.begin(), colliders.end());
  sendPoses(nowUs);
}

void Client::setHand(std::uint32_t side, std::span<const float> joints, std::uint64_t nowUs) {
  std::vector<float>& hand = side == CS_HAND_LEFT ? poses_.leftHand : poses_.rightHand;
  hand.assign(joints.begin(), joints.end());
  sendPoses(nowUs);
}

void Client::setHead(const std::optional<cs_own_collider>& head, std::uint64_t nowUs) {
  poses_.head = head;
  sendPoses(nowUs);
}

void Client::setGrabs(std::span<const cs_grab> grabs, std::uint64_t nowUs) {
  poses_.grabs.clear();
  for (const cs_grab& grab : grabs) {
    OwnGrab& own = poses_.grabs.emplace_back();
    own.given = grab;
    own.given.place = nullptr;
    if (!grab.place) continue;
    own.point = *grab.place;
    own.place = triangleOf(grab.place->triangle, description_);
  }
  sendPoses(nowUs);
}

std::optional<cs_cloth_point> Client::seen(std::optional<cs_cloth_point> point) const {
  if (point) point->tick = shownTick();
  return point;
}

std::optional<cs_cloth_point> Client::nearestPoint(const Vec3& point, float maxDistance) const {
  return seen(client::nearestPoint({description_.triangles, playedPositions()},
                                   {point[0], point[1], point[2]}, maxDistance));
}

std::optional<cs_cloth_point> Client::castRay(const Vec3& origin, const Vec3& direction,
                                              float maxDistance) const {
  return seen(client::castRay({description_.triangles, playedPositions()}, {origin[0], origin[1], origin[2]},
                              {direction[0], direction[1], direction[2]}, maxDistance));
}

void Client::wantContacts(bool wants, std::uint64_t nowUs) {
  poses_.wantsContacts = wants;
  sendPoses(nowUs);
}

void Client::wantConstraints(bool wants, std::uint64_t nowUs) {
  poses_.wantsConstraints = wants;
  sendPoses(nowUs);
}

void Client::move(AttachmentPose attachment, std::uint64_t nowUs) {
  const auto known =
      std::find_if(poses_.attachments.begin(), poses_.attachments.end(),
                   [&](const AttachmentPose& waiting) { return waiting.name == attachment.name; });
  if (known != poses_.attachments.end())
    *known = std::move(attachment);
  else
    poses_.attachments.push_back(std::move(attachment));
  sendPoses(nowUs);
}

void Client::move(ColliderJoints joints, std::uint64_t nowUs) {
  const auto known =
      std::find_if(poses_.joints.begin(), poses_.joints.end(),
                   [&](const ColliderJoints& waiting) { return waiting.collider == joints.collider; });
  if (known != poses_.joints.end())
    *known = std::move(joints);
  else
    poses_.joints.push_back(std::move(joints));
  sendPoses(nowUs);
}

bool Client::mayCollide() const {
  return (welcomed_ ? welcome_.role : hello_.role) != CS_ROLE_VIEWER;
}

void Client::sendPoses(std::uint64_t nowUs) {
  posed_ = true;
  if (contact_) ownCapsules_.add(ownCapsules(poses_), nowUs);
  if (state_ == CS_STATE_FAILED || !isConnected()) return;
  const std::uint64_t serverUs = clock_.serverTimeUs(nowUs);
  if (mayCollide()) return writeColliderPoses(outbox_.poses(), poses_, nowUs, serverUs);
  // A viewer sends no poses, only whether it wants contact events and the names of constraints.
  Poses none;
  none.wantsContacts = poses_.wantsContacts;
  none.wantsConstraints = poses_.wantsConstraints;
  writeColliderPoses(outbox_.poses(), none, nowUs, serverUs);
}

bool Client::setPlayOut(const cs_play_out_options* options) {
  if (options && !isAllowed(*options)) return false;
  playOut_ = options ? std::make_unique<PlayOut>(*options) : nullptr;
  if (playOut_ && described()) playOut_->begin(description_);
  return true;
}

std::optional<cs_played> Client::play(std::uint64_t nowUs, std::uint64_t displayUs) {
  if (!playOut_) return std::nullopt;
  shown_ = {};
  const cs_played played = playOut_->play(clock_.serverTimeUs(nowUs), clock_.serverTimeUs(displayUs));
  playedTick_ = played.tick;
  if (contact_) correct(played, displayUs);
  return played;
}

void Client::setLocalContact(bool on) {
  shown_ = {};
  ownCapsules_ = {};
  contact_ = on ? std::make_unique<Contact>() : nullptr;
  if (contact_ && described()) contact_->begin(description_);
}

// The frame states where the server saw the capsules. If they are not recognised, they are taken as they were
// when the frame was simulated, less the way of the message to the server.
void Client::correct(const cs_played& played, std::uint64_t displayUs) {
  if (ownCapsules_.empty() || !mayCollide() || played.server_time_us == 0 || !playOut_->shows()) return;
  const double ageUs =
      since(played.server_time_us, clock_.serverTimeUs(displayUs)) + 500 * clock_.roundTripMs();
  const auto age = static_cast<std::uint64_t>(std::clamp(ageUs, 0.0, static_cast<double>(displayUs)));
  const OwnCapsules sent = ownCapsules_.at(displayUs - age);
  const OwnCapsules answered = capsulesOf(playedColliders(), welcome_.participantId, sent).value_or(sent);
  const std::span<const float> positions = playOut_->positions();
  const std::span<const float> shown = contact_->apply(positions, answered, ownCapsules_.newest(), displayUs);
  if (contact_->largest() > 0) shown_ = shown;
}

void Client::change(const ParameterChange& change) {
  std::string message;
  writeParameterChange(message, ++lastRequestId_, change);
  send(std::move(message));
}

void Client::changeCollider(std::string_view collider, const cs_collider_change& change) {
  std::string message;
  writeColliderChange(message, ++lastRequestId_, collider, change);
  send(std::move(message));
}

void Client::control(const SceneControl& control) {
  if (state_ != CS_STATE_JOINED) return;
  std::string message;
  writeControlScene(message, ++lastRequestId_, welcome_.scene, control);
  send(std::move(message));
}

void Client::listScenes() {
  std::string message;
  writeListScenes(message, ++lastRequestId_);
  send(std::move(message));
}

void Client::setRole(std::uint64_t participant, std::uint32_t role) {
  std::string message;
  writeSetRole(message, ++lastRequestId_, participant, role);
  send(std::move(message));
}

void Client::remove(std::uint64_t participant, bool ban) {
  std::string message;
  writeRemoveParticipant(message, ++lastRequestId_, participant, ban);
  send(std::move(message));
}

void Client::createPairingCode(std::uint32_t role) {
  std::string message;
  writeCreatePairingCode(message, ++lastRequestId_, role);
  send(std::move(message));
}

void Client::requestEarlyKeyFrame(std::uint64_t nowUs) {
  if (state_ == CS_STATE_JOINED) requestKeyFrame(nowUs, true);
}

}  // namespace clothstream::client
