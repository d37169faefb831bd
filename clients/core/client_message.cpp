// SPDX-License-Identifier: MIT
// Field numbers of session.proto, going out.
#include "clients/core/client_message.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <protozero/pbf_writer.hpp>

#include "clients/core/core.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::client {
namespace {

using Writer = protozero::pbf_writer;

// ClientMessage's bodies.
enum BodyField : std::uint32_t {
  kHello = 2,
  kColliderPoses = 3,
  kParameterChange = 4,
  kPing = 5,
  kFrameAck = 6,
  kKeyFrameRequest = 7,
  kListScenes = 16,
  kControlScene = 20,
  kSetRole = 30,
  kRemoveParticipant = 31,
};

template <typename Fill>
void writeMessage(std::string& out, std::uint64_t requestId, BodyField field, Fill fill) {
  out.clear();
  Writer message(out);
  if (requestId != 0) message.add_uint64(1, requestId);
  Writer body(message, field);
  fill(body);
}

void addVec3(Writer& parent, std::uint32_t field, const Vec3& value) {
  Writer vec3(parent, field);
  for (std::uint32_t i = 0; i < 3; ++i) vec3.add_float(i + 1, value[i]);
}

// Absent where it is not turned, for a Writer leaves out nothing by itself.
void addPose(Writer& parent, std::uint32_t field, std::span<const float, 3> position,
             std::span<const float, 4> orientation) {
  Writer pose(parent, field);
  addVec3(pose, 1, {position[0], position[1], position[2]});
  if (std::all_of(orientation.begin(), orientation.end(), [](float part) { return part == 0; })) return;
  Writer turned(pose, 2);
  for (std::uint32_t i = 0; i < 4; ++i) turned.add_float(i + 1, orientation[i]);
}

void addGrab(Writer& poses, const cs_grab& grab) {
  Writer message(poses, 3);
  message.add_uint32(1, grab.id);
  addPose(message, 2, grab.position, grab.orientation);
  const float settings[] = {grab.radius, grab.reach, grab.max_force, grab.slip_distance};
  for (std::uint32_t i = 0; i < 4; ++i)
    if (!std::isnan(settings[i])) message.add_float(3 + i, settings[i]);
}

void addHand(Writer& poses, std::uint32_t side, const std::vector<float>& joints) {
  if (joints.empty()) return;
  std::vector<float> positions, radii;
  for (std::size_t i = 0; i < joints.size(); i += 4) {
    positions.insert(positions.end(), {joints[i], joints[i + 1], joints[i + 2]});
    radii.push_back(joints[i + 3]);
  }
  Writer hand(poses, 61);
  hand.add_uint32(1, side);
  hand.add_packed_float(2, positions.begin(), positions.end());
  hand.add_packed_float(3, radii.begin(), radii.end());
}

// Of a ParticipantCollider. What is none of its shapes is left out, and refused by the server.
void addShape(Writer& parent, const cs_own_collider& collider) {
  if (collider.shape == CS_SHAPE_SPHERE) {
    Writer sphere(parent, 3);
    sphere.add_float(1, collider.radius);
  } else if (collider.shape == CS_SHAPE_CAPSULE) {
    Writer capsule(parent, 4);
    capsule.add_float(1, collider.radius);
    capsule.add_float(2, collider.length);
  } else if (collider.shape == CS_SHAPE_BOX) {
    Writer box(parent, 5);
    addVec3(box, 1, {collider.size[0], collider.size[1], collider.size[2]});
  }
}

}  // namespace

void writeHello(std::string& out, std::uint64_t requestId, const Greeting& greeting) {
  writeMessage(out, requestId, kHello, [&](Writer& hello) {
    hello.add_uint32(1, CS_PROTOCOL_VERSION);
    hello.add_packed_uint32(2, codec::kCodecs.begin(), codec::kCodecs.end());
    hello.add_string(3, greeting.scene);
    hello.add_string(4, greeting.clientName);
    hello.add_string(5, greeting.displayName);
    if (greeting.wanted.quality > 0) hello.add_uint32(6, greeting.wanted.quality);
    if (greeting.wanted.temporalLayers > 0) hello.add_uint32(7, greeting.wanted.temporalLayers - 1);
    hello.add_uint32(30, greeting.role);
    if (greeting.token.empty()) return;
    hello.add_bytes(31, greeting.token);
    hello.add_uint64(32, greeting.contentId);
    hello.add_uint32(60, greeting.attempt);
  });
}

void writeColliderPoses(std::string& out, const Poses& poses, std::uint64_t clientTimeUs,
                        std::uint64_t serverTimeUs) {
  // The server takes so many, with what it makes of hands.
  constexpr std::size_t kMost = CS_MAX_COLLIDERS + CS_HAND_BONES;
  const std::size_t ofHands =
      CS_HAND_BONES * ((poses.leftHand.empty() ? 0u : 1u) + (poses.rightHand.empty() ? 0u : 1u));
  writeMessage(out, 0, kColliderPoses, [&](Writer& message) {
    for (std::size_t i = 0; i < std::min(poses.colliders.size(), kMost - ofHands); ++i) {
      const cs_own_collider& from = poses.colliders[i];
      Writer collider(message, 1);
      collider.add_uint32(1, static_cast<std::uint32_t>(i));
      addPose(collider, 2, from.position, from.orientation);
      addShape(collider, from);
    }
    message.add_uint64(2, clientTimeUs);
    for (const cs_grab& grab : poses.grabs) addGrab(message, grab);
    for (const AttachmentPose& put : poses.attachments) {
      Writer attachment(message, 4);
      attachment.add_string(1, put.name.data(), put.name.size());
      addPose(attachment, 2, put.position, put.orientation);
    }
    if (poses.wantsContacts) message.add_bool(5, true);
    if (serverTimeUs != 0) message.add_uint64(60, serverTimeUs);
    addHand(message, CS_HAND_LEFT, poses.leftHand);
    addHand(message, CS_HAND_RIGHT, poses.rightHand);
  });
}

void writeParameterChange(std::string& out, std::uint64_t requestId, const ParameterChange& change) {
  writeMessage(out, requestId, kParameterChange,
               [&](Writer& parameters) { writeFields(parameters, change); });
}

void writeColliderChange(std::string& out, std::uint64_t requestId, const ColliderChange& change) {
  writeMessage(out, requestId, kParameterChange, [&](Writer& parameters) {
    Writer collider(parameters, 5);
    collider.add_string(1, change.name.data(), change.name.size());
    if (change.position) addVec3(collider, 2, *change.position);
    if (change.radius) collider.add_float(3, *change.radius);
  });
}

void writePing(std::string& out, std::uint64_t requestId, std::uint64_t clientTimeUs) {
  writeMessage(out, requestId, kPing, [&](Writer& ping) { ping.add_uint64(1, clientTimeUs); });
}

void writeFrameAck(std::string& out, std::uint64_t tick) {
  writeMessage(out, 0, kFrameAck, [&](Writer& ack) { ack.add_uint64(1, tick); });
}

void writeKeyFrameRequest(std::string& out, std::uint32_t epoch, bool early) {
  writeMessage(out, 0, kKeyFrameRequest, [&](Writer& request) {
    request.add_uint32(1, epoch);
    if (early) request.add_bool(2, true);
  });
}

void writeSetRole(std::string& out, std::uint64_t requestId, std::uint64_t participant, std::uint32_t role) {
  writeMessage(out, requestId, kSetRole, [&](Writer& message) {
    message.add_uint64(1, participant);
    message.add_uint32(2, role);
  });
}

void writeRemoveParticipant(std::string& out, std::uint64_t requestId, std::uint64_t participant) {
  writeMessage(out, requestId, kRemoveParticipant,
               [&](Writer& message) { message.add_uint64(1, participant); });
}

void writeListScenes(std::string& out, std::uint64_t requestId) {
  out.clear();
  Writer message(out);
  message.add_uint64(1, requestId);
  // Said outright: a Writer leaves out a submessage that nothing was added to.
  message.add_message(kListScenes, std::string());
}

void writeControlScene(std::string& out, std::uint64_t requestId, std::string_view scene,
                       const SceneControl& control) {
  writeMessage(out, requestId, kControlScene, [&](Writer& request) {
    request.add_bytes(1, scene.data(), scene.size());
    if (control.paused) request.add_bool(2, *control.paused);
    if (control.seek) request.add_double(50, *control.seek);
    if (control.speed) request.add_double(51, *control.speed);
    if (control.loop) request.add_bool(52, *control.loop);
  });
}

}  // namespace clothstream::client
