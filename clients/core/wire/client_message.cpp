// SPDX-License-Identifier: MIT
// Writes the messages of session.proto that a client sends.
#include "clients/core/wire/client_message.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <protozero/pbf_writer.hpp>

#include "clients/core/core.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::client {
namespace {

using Writer = protozero::pbf_writer;

// The kind of a solver is the number of its field in Solver.kind.
static_assert(CS_SOLVER_MASS_SPRING == field::Solver::kMassSpring.number &&
              CS_SOLVER_CONSTRAINT == field::Solver::kConstraint.number &&
              CS_SOLVER_ACAD == field::Solver::kAcad.number &&
              CS_SOLVER_XPBD == field::Solver::kXpbd.number &&
              CS_SOLVER_IMPLICIT_EULER == field::Solver::kImplicitEuler.number);

template <typename Fill>
void writeMessage(std::string& out, std::uint64_t requestId, field::Field bodyField, Fill fill) {
  out.clear();
  Writer message(out);
  if (requestId != 0) message.add_uint64(field::ClientMessage::kRequestId.number, requestId);
  Writer body(message, bodyField.number);
  fill(body);
}

Vec3 toVec3(std::span<const float, 3> numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

void addQuaternion(Writer& parent, field::Field quaternionField, std::span<const float, 4> numbers) {
  Writer quaternion(parent, quaternionField.number);
  quaternion.add_float(field::Quaternion::kX.number, numbers[0]);
  quaternion.add_float(field::Quaternion::kY.number, numbers[1]);
  quaternion.add_float(field::Quaternion::kZ.number, numbers[2]);
  quaternion.add_float(field::Quaternion::kW.number, numbers[3]);
}

// Omits an orientation that is all zero. Writer itself omits nothing.
void addPose(Writer& parent, field::Field poseField, std::span<const float, 3> position,
             std::span<const float, 4> orientation) {
  Writer pose(parent, poseField.number);
  addVec3(pose, field::Pose::kPosition, toVec3(position));
  if (std::all_of(orientation.begin(), orientation.end(), [](float part) { return part == 0; })) return;
  addQuaternion(pose, field::Pose::kOrientation, orientation);
}

void addGiven(Writer& message, field::Field floatField, float value) {
  if (!std::isnan(value)) message.add_float(floatField.number, value);
}

void addGrab(Writer& poses, const OwnGrab& own) {
  using F = field::Grab;
  const cs_grab& grab = own.given;
  Writer message(poses, field::ColliderPoses::kGrabs.number);
  message.add_uint32(F::kId.number, grab.id);
  addPose(message, F::kPose, grab.position, grab.orientation);
  addGiven(message, F::kRadius, grab.radius);
  addGiven(message, F::kReach, grab.reach);
  addGiven(message, F::kMaxForce, grab.max_force);
  addGiven(message, F::kSlipDistance, grab.slip_distance);
  if (!own.place) return;
  using P = field::GrabPlace;
  Writer place(message, F::kPlace.number);
  place.add_uint32(P::kCloth.number, own.place->cloth);
  place.add_uint32(P::kTriangle.number, own.place->triangle);
  place.add_float(P::kSecond.number, own.point.second);
  place.add_float(P::kThird.number, own.point.third);
  place.add_uint64(P::kSeenTick.number, own.point.tick);
}

void addWind(Writer& poses, std::uint32_t id, const cs_own_wind& from) {
  Writer held(poses, field::ColliderPoses::kWinds.number);
  held.add_uint32(field::HeldWind::kId.number, id);
  using F = field::LocalWind;
  Writer wind(held, field::HeldWind::kWind.number);
  addPose(wind, F::kPose, from.position, from.orientation);
  addGiven(wind, F::kSpeed, from.speed);
  if (from.kind == CS_WIND_FAN) {
    Writer fan(wind, F::kFan.number);
    addGiven(fan, field::Fan::kRadius, from.radius);
    addGiven(fan, field::Fan::kSpread, from.spread);
    addGiven(fan, field::Fan::kRange, from.reach);
  } else {
    Writer vortex(wind, F::kVortex.number);
    addGiven(vortex, field::Vortex::kRadius, from.radius);
    addGiven(vortex, field::Vortex::kReach, from.reach);
  }
}

void addHand(Writer& poses, std::uint32_t side, const std::vector<float>& joints) {
  if (joints.empty()) return;
  std::vector<float> positions, radii;
  for (std::size_t i = 0; i < joints.size(); i += 4) {
    positions.insert(positions.end(), {joints[i], joints[i + 1], joints[i + 2]});
    radii.push_back(joints[i + 3]);
  }
  Writer hand(poses, field::ColliderPoses::kHands.number);
  hand.add_uint32(field::HandJoints::kSide.number, side);
  hand.add_packed_float(field::HandJoints::kPositions.number, positions.begin(), positions.end());
  hand.add_packed_float(field::HandJoints::kRadii.number, radii.begin(), radii.end());
}

// Adds the shape of a ParticipantCollider. Other shapes are omitted, so the server refuses the message.
void addShape(Writer& parent, const cs_own_collider& collider) {
  if (collider.shape == CS_SHAPE_SPHERE) {
    Writer sphere(parent, field::ParticipantCollider::kSphere.number);
    sphere.add_float(field::Sphere::kRadius.number, collider.radius);
  } else if (collider.shape == CS_SHAPE_CAPSULE) {
    Writer capsule(parent, field::ParticipantCollider::kCapsule.number);
    capsule.add_float(field::Capsule::kRadius.number, collider.radius);
    capsule.add_float(field::Capsule::kLength.number, collider.length);
    if (collider.top_radius != 0) capsule.add_float(field::Capsule::kTopRadius.number, collider.top_radius);
  } else if (collider.shape == CS_SHAPE_BOX) {
    Writer box(parent, field::ParticipantCollider::kBox.number);
    addVec3(box, field::Box::kSize, toVec3(collider.size));
  }
}

void addCollider(Writer& message, std::uint32_t id, const cs_own_collider& from) {
  Writer collider(message, field::ColliderPoses::kColliders.number);
  collider.add_uint32(field::ParticipantCollider::kId.number, id);
  addPose(collider, field::ParticipantCollider::kPose, from.position, from.orientation);
  addShape(collider, from);
}

}  // namespace

void writeAuthenticate(std::string& out, std::uint64_t requestId, const Proof& proof) {
  writeMessage(out, requestId, field::ClientMessage::kAuthenticate, [&](Writer& message) {
    using F = field::AuthenticateRequest;
    if (!proof.token.empty())
      message.add_string(F::kToken.number, proof.token);
    else
      message.add_string(F::kPairingCode.number, proof.pairingCode);
  });
}

void writeCreatePairingCode(std::string& out, std::uint64_t requestId, std::uint32_t role) {
  writeMessage(out, requestId, field::ClientMessage::kCreatePairingCode, [&](Writer& message) {
    message.add_uint32(field::CreatePairingCodeRequest::kRole.number, role);
  });
}

void writeHello(std::string& out, std::uint64_t requestId, const Hello& hello) {
  writeMessage(out, requestId, field::ClientMessage::kHello, [&](Writer& message) {
    using F = field::Hello;
    message.add_uint32(F::kProtocolVersion.number, CS_PROTOCOL_VERSION);
    message.add_packed_uint32(F::kCodecs.number, codec::kCodecs.begin(), codec::kCodecs.end());
    message.add_string(F::kScene.number, hello.scene);
    message.add_string(F::kClientName.number, hello.clientName);
    message.add_string(F::kDisplayName.number, hello.displayName);
    if (hello.quality > 0) message.add_uint32(F::kQuality.number, hello.quality);
    message.add_uint32(F::kRole.number, hello.role);
    if (hello.token.empty()) return;
    message.add_bytes(F::kResumeToken.number, hello.token);
    message.add_uint64(F::kDescriptionContentId.number, hello.contentId);
    message.add_uint32(F::kAttempt.number, hello.attempt);
  });
}

void writeColliderPoses(std::string& out, const Poses& poses, std::uint64_t clientTimeUs,
                        std::uint64_t serverTimeUs) {
  // The server's limit, including the bones that it builds for each hand.
  constexpr std::size_t kMost = CS_MAX_COLLIDERS + CS_HAND_BONES;
  const std::size_t ofBody =
      CS_HAND_BONES * ((poses.leftHand.empty() ? 0u : 1u) + (poses.rightHand.empty() ? 0u : 1u)) +
      (poses.head ? 1u : 0u);
  writeMessage(out, 0, field::ClientMessage::kColliderPoses, [&](Writer& message) {
    using F = field::ColliderPoses;
    for (std::size_t i = 0; i < std::min(poses.colliders.size(), kMost - ofBody); ++i)
      addCollider(message, static_cast<std::uint32_t>(i), poses.colliders[i]);
    if (poses.head) addCollider(message, CS_HEAD_ID, *poses.head);
    message.add_uint64(F::kClientTimeUs.number, clientTimeUs);
    for (const OwnGrab& grab : poses.grabs) addGrab(message, grab);
    for (const AttachmentPose& put : poses.attachments) {
      Writer attachment(message, F::kAttachments.number);
      attachment.add_string(field::AttachmentPose::kName.number, put.name.data(), put.name.size());
      addPose(attachment, field::AttachmentPose::kPose, put.position, put.orientation);
      if (put.jumps) attachment.add_bool(field::AttachmentPose::kJumps.number, true);
    }
    for (const ColliderJoints& moved : poses.joints) {
      Writer joints(message, F::kJoints.number);
      joints.add_string(field::ColliderJoints::kCollider.number, moved.collider.data(),
                        moved.collider.size());
      for (std::size_t i = 0; i + kJointNumbers <= moved.poses.size(); i += kJointNumbers) {
        const float* const at = moved.poses.data() + i;
        addPose(joints, field::ColliderJoints::kJoints, std::span<const float, 3>(at, 3),
                std::span<const float, 4>(at + 3, 4));
      }
      if (moved.jumps) joints.add_bool(field::ColliderJoints::kJumps.number, true);
    }
    for (std::size_t i = 0; i < poses.winds.size(); ++i)
      addWind(message, static_cast<std::uint32_t>(i), poses.winds[i]);
    if (poses.wantsContacts) message.add_bool(F::kContactEvents.number, true);
    if (poses.wantsConstraints) message.add_bool(F::kActiveConstraints.number, true);
    if (serverTimeUs != 0) message.add_uint64(F::kServerTimeUs.number, serverTimeUs);
    addHand(message, CS_HAND_LEFT, poses.leftHand);
    addHand(message, CS_HAND_RIGHT, poses.rightHand);
  });
}

void writeParameterChange(std::string& out, std::uint64_t requestId, const ParameterChange& change) {
  writeMessage(out, requestId, field::ClientMessage::kParameterChange,
               [&](Writer& message) { writeFields(message, change); });
}

void writeColliderChange(std::string& out, std::uint64_t requestId, std::string_view name,
                         const cs_collider_change& change) {
  writeMessage(out, requestId, field::ClientMessage::kParameterChange, [&](Writer& parameters) {
    using F = field::ColliderChange;
    Writer collider(parameters, field::ParameterChange::kColliders.number);
    collider.add_string(F::kName.number, name.data(), name.size());
    if (!std::isnan(change.position[0])) addVec3(collider, F::kPosition, toVec3(change.position));
    if (!std::isnan(change.orientation[0])) addQuaternion(collider, F::kOrientation, change.orientation);
    addGiven(collider, F::kRadius, change.radius);
    addGiven(collider, F::kLength, change.length);
    if (!std::isnan(change.size[0])) addVec3(collider, F::kSize, toVec3(change.size));
    addGiven(collider, F::kFriction, change.friction);
  });
}

void writeWearBody(std::string& out, std::uint64_t requestId, const std::optional<StandingBody>& body) {
  using F = field::WearBody;
  std::string content;  // a nested Writer omits an empty message
  if (body) {
    Writer message(content);
    message.add_string(F::kCollider.number, body->collider.data(), body->collider.size());
    addPose(message, F::kStands, body->position, body->orientation);
  }
  out.clear();
  Writer message(out);
  message.add_uint64(field::ClientMessage::kRequestId.number, requestId);
  message.add_message(field::ClientMessage::kWearBody.number, content);
}

void writePing(std::string& out, std::uint64_t requestId, std::uint64_t clientTimeUs) {
  writeMessage(out, requestId, field::ClientMessage::kPing,
               [&](Writer& ping) { ping.add_uint64(field::Ping::kClientTimeUs.number, clientTimeUs); });
}

void writeFrameAck(std::string& out, std::uint64_t tick) {
  writeMessage(out, 0, field::ClientMessage::kFrameAck,
               [&](Writer& ack) { ack.add_uint64(field::FrameAck::kTick.number, tick); });
}

void writeKeyFrameRequest(std::string& out, std::uint32_t epoch, bool early) {
  writeMessage(out, 0, field::ClientMessage::kKeyFrameRequest, [&](Writer& request) {
    request.add_uint32(field::KeyFrameRequest::kEpoch.number, epoch);
    if (early) request.add_bool(field::KeyFrameRequest::kEarly.number, true);
  });
}

void writeSetRole(std::string& out, std::uint64_t requestId, std::uint64_t participant, std::uint32_t role) {
  writeMessage(out, requestId, field::ClientMessage::kSetRole, [&](Writer& message) {
    message.add_uint64(field::SetRole::kParticipantId.number, participant);
    message.add_uint32(field::SetRole::kRole.number, role);
  });
}

void writeRemoveParticipant(std::string& out, std::uint64_t requestId, std::uint64_t participant, bool ban) {
  writeMessage(out, requestId, field::ClientMessage::kRemoveParticipant, [&](Writer& message) {
    message.add_uint64(field::RemoveParticipant::kParticipantId.number, participant);
    if (ban) message.add_bool(field::RemoveParticipant::kBan.number, true);
  });
}

void writeListScenes(std::string& out, std::uint64_t requestId) {
  out.clear();
  Writer message(out);
  message.add_uint64(field::ClientMessage::kRequestId.number, requestId);
  // A nested Writer omits an empty submessage, so the body is added as bytes.
  message.add_message(field::ClientMessage::kListScenes.number, std::string());
}

void writeControlScene(std::string& out, std::uint64_t requestId, std::string_view scene,
                       const SceneControl& control) {
  writeMessage(out, requestId, field::ClientMessage::kControlScene, [&](Writer& request) {
    using F = field::ControlSceneRequest;
    request.add_bytes(F::kName.number, scene.data(), scene.size());
    if (control.paused) request.add_bool(F::kPaused.number, *control.paused);
    if (control.reset) request.add_bool(F::kReset.number, true);
    if (control.seek) request.add_double(F::kSeek.number, *control.seek);
    if (control.speed) request.add_double(F::kSpeed.number, *control.speed);
    if (control.loop) request.add_bool(F::kLoop.number, *control.loop);
  });
}

}  // namespace clothstream::client
