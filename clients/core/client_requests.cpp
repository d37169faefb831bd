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
    own.place = triangleOf(grab.place->triangle, stream_.description());
  }
  sendPoses(nowUs);
}

void Client::setWinds(std::span<const cs_own_wind> winds, std::uint64_t nowUs) {
  poses_.winds.assign(winds.begin(), winds.end());
  sendPoses(nowUs);
}

std::optional<cs_cloth_point> Client::seen(std::optional<cs_cloth_point> point) const {
  if (point) point->tick = shownTick();
  return point;
}

std::optional<cs_cloth_point> Client::nearestPoint(const Vec3& point, float maxDistance) const {
  return seen(client::nearestPoint({stream_.description().triangles, playedPositions()},
                                   {point[0], point[1], point[2]}, maxDistance));
}

std::optional<cs_cloth_point> Client::castRay(const Vec3& origin, const Vec3& direction,
                                              float maxDistance) const {
  return seen(client::castRay({stream_.description().triangles, playedPositions()},
                              {origin[0], origin[1], origin[2]}, {direction[0], direction[1], direction[2]},
                              maxDistance));
}

void Client::wantContacts(bool wants, std::uint64_t nowUs) {
  poses_.wantsContacts = wants;
  sendPoses(nowUs);
}

void Client::wantConstraints(bool wants, std::uint64_t nowUs) {
  poses_.wantsConstraints = wants;
  sendPoses(nowUs);
}

namespace {

// Replaces what waits for the same thing, or adds it. One that should jump still jumps.
template <typename Moved, typename Name>
void replace(std::vector<Moved>& waiting, Moved moved, Name name) {
  const auto known = std::find_if(waiting.begin(), waiting.end(),
                                  [&](const Moved& one) { return one.*name == moved.*name; });
  if (known == waiting.end()) {
    waiting.push_back(std::move(moved));
  } else {
    moved.jumps = moved.jumps || known->jumps;
    *known = std::move(moved);
  }
}

}  // namespace

void Client::move(AttachmentPose attachment, std::uint64_t nowUs) {
  replace(poses_.attachments, std::move(attachment), &AttachmentPose::name);
  sendPoses(nowUs);
}

void Client::move(ColliderJoints joints, std::uint64_t nowUs) {
  replace(poses_.joints, std::move(joints), &ColliderJoints::collider);
  sendPoses(nowUs);
}

bool Client::wear(std::string_view collider) {
  if (collider.empty()) {
    // The body may also be of an earlier client of this participant.
    const bool wears = worn_.has_value() || !participants_.bodyOf(welcome_.participantId).empty();
    worn_.reset();
    if (wears) sendWearing();
    return true;
  }
  if (worn_ && worn_->collider() == collider) return true;
  std::optional<body::Humanoid> humanoid = humanoidOf(collider);
  if (!humanoid) return false;
  worn_.emplace(std::string(collider), std::move(*humanoid));
  sendWearing();
  return true;
}

std::optional<body::Humanoid> Client::humanoidOf(std::string_view collider) const {
  const auto& hulls = stream_.description().hulls;
  const auto found = hulls.find(std::string(collider));
  if (state_ != CS_STATE_JOINED || found == hulls.end()) return std::nullopt;
  return body::findHumanoid(found->second);
}

void Client::sendWearing() {
  std::optional<StandingBody> standing;
  if (worn_)
    for (const Collider& collider : colliders())
      if (collider.participantId == 0 && collider.name == worn_->collider())
        standing = {
            .collider = collider.name, .position = collider.position, .orientation = collider.orientation};
  wearRequest_ = requests_.nextId();
  std::string message;
  writeWearBody(message, wearRequest_, standing);
  send(std::move(message));
}

void Client::wearingRefused() {
  wearRequest_ = 0;
  worn_.reset();
  const std::string& own = participants_.bodyOf(welcome_.participantId);
  std::optional<body::Humanoid> humanoid = humanoidOf(own);
  if (!humanoid) return;
  worn_.emplace(own, std::move(*humanoid));
  worn_->announced(own);
}

void Client::checkWorn() {
  if (!worn_) return;
  const auto found = stream_.description().hulls.find(worn_->collider());
  if (found == stream_.description().hulls.end() || !worn_->fits(found->second)) {
    worn_.reset();
    sendWearing();
  }
}

bool Client::moveBody(const body::Tracked& tracked, std::uint64_t nowUs) {
  if (!worn_) return false;
  const auto collider = std::find_if(colliders().begin(), colliders().end(), [&](const Collider& one) {
    return one.participantId == 0 && one.name == worn_->collider();
  });
  if (collider == colliders().end()) return false;
  const bool jumps = worn_->update(tracked, *collider, nowUs);
  move({.collider = worn_->collider(), .poses = worn_->poses(), .jumps = jumps}, nowUs);
  return true;
}

bool Client::setSurface(OwnSurface surface) {
  if (timer_.isWelcomed() && !maySendSurfaces()) return false;
  surfaces_.set(std::move(surface));
  return true;
}

void Client::allowSurfaces(std::uint32_t policy) {
  allowedSurfaces_ = policy;
  if (!timer_.isWelcomed()) return;
  if (maySendSurfaces())
    surfaces_.allow();
  else
    surfaces_.takeBack();
}

bool Client::mayCollide() const {
  return (timer_.isWelcomed() ? welcome_.role : hello_.role) != CS_ROLE_VIEWER;
}

void Client::sendPoses(std::uint64_t nowUs) {
  posed_ = true;
  display_.moved(poses_, nowUs);
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
  return display_.setPlayOut(options, stream_.begun() ? &stream_.description() : nullptr);
}

void Client::setLocalContact(bool on) {
  display_.setLocalContact(on, stream_.begun() ? &stream_.description() : nullptr);
}

std::optional<cs_played> Client::play(std::uint64_t nowUs, std::uint64_t displayUs) {
  return display_.play(clock_, nowUs, displayUs, mayCollide() ? welcome_.participantId : 0);
}

void Client::change(const ParameterChange& change) {
  std::string message;
  writeParameterChange(message, requests_.nextId(), change);
  send(std::move(message));
}

void Client::changeCollider(std::string_view collider, const cs_collider_change& change) {
  std::string message;
  writeColliderChange(message, requests_.nextId(), collider, change);
  send(std::move(message));
}

void Client::control(const SceneControl& control) {
  if (state_ != CS_STATE_JOINED) return;
  std::string message;
  writeControlScene(message, requests_.nextId(), welcome_.scene, control);
  send(std::move(message));
}

void Client::listScenes() {
  std::string message;
  writeListScenes(message, requests_.nextId());
  send(std::move(message));
}

void Client::setRole(std::uint64_t participant, std::uint32_t role) {
  std::string message;
  writeSetRole(message, requests_.nextId(), participant, role);
  send(std::move(message));
}

void Client::remove(std::uint64_t participant, bool ban) {
  std::string message;
  writeRemoveParticipant(message, requests_.nextId(), participant, ban);
  send(std::move(message));
}

void Client::createPairingCode(std::uint32_t role) {
  std::string message;
  writeCreatePairingCode(message, requests_.nextId(), role);
  send(std::move(message));
}

void Client::requestEarlyKeyFrame(std::uint64_t nowUs) {
  if (state_ == CS_STATE_JOINED) requestKeyFrame(nowUs, true);
}

}  // namespace clothstream::client
