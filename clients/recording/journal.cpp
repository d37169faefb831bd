// SPDX-License-Identifier: MIT
#include "clients/recording/journal.h"

#include <array>
#include <cstddef>
#include <cstring>

#include "clients/core/wire/collider.h"
#include "clients/core/wire/limits.h"

namespace clothstream::client {
namespace {

constexpr cs_recorded_pose kNoPose{.position = {0, 0, 0}, .orientation = {0, 0, 0, 1}};

template <std::size_t N>
bool readArray(Bytes message, float (&out)[N]) {
  std::array<float, N> values{};
  if (!readFloats(message, values)) return false;
  std::memcpy(out, values.data(), sizeof out);
  return true;
}

bool readPose(Bytes message, cs_recorded_pose& pose) {
  using F = field::Pose;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kPosition.tag) return readArray(reader.get_view(), pose.position);
    if (tag != F::kOrientation.tag) return skip(reader);
    if (!readArray(reader.get_view(), pose.orientation)) return false;
    // All zero means no rotation (scene.proto).
    const auto& [x, y, z, w] = pose.orientation;
    if (x == 0 && y == 0 && z == 0 && w == 0) pose.orientation[3] = 1;
    return true;
  });
}

bool readShape(Bytes message, cs_shape shape, cs_recorded_collider& out) {
  out.shape = shape;
  if (shape == CS_SHAPE_PLANE) return true;
  Collider collider;
  if (!(shape == CS_SHAPE_BOX ? readBox(message, collider.size) : readRound(message, collider))) return false;
  out.radius = collider.radius;
  out.length = collider.length;
  out.top_radius = collider.topRadius;
  std::memcpy(out.size, collider.size.data(), sizeof out.size);
  return true;
}

bool readApplied(Bytes message, cs_recorded_collider& out) {
  using F = field::AppliedCollider;
  out = {};
  out.shape = CS_SHAPE_HULL;
  out.start = out.end = kNoPose;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kStart.tag:
        return readPose(reader.get_view(), out.start);
      case F::kEnd.tag:
        return readPose(reader.get_view(), out.end);
      case F::kFriction.tag:
        return setFinite(out.friction, reader);
      case F::kParticipantId.tag:
        return set(out.participant_id, reader.get_uint64());
      case F::kId.tag:
        return set(out.id, reader.get_uint32());
      case F::kSphere.tag:
        return readShape(reader.get_view(), CS_SHAPE_SPHERE, out);
      case F::kCapsule.tag:
        return readShape(reader.get_view(), CS_SHAPE_CAPSULE, out);
      case F::kPlane.tag:
        return readShape(reader.get_view(), CS_SHAPE_PLANE, out);
      case F::kBox.tag:
        return readShape(reader.get_view(), CS_SHAPE_BOX, out);
      default:
        return skip(reader);
    }
  });
}

bool readApplied(Bytes message, cs_recorded_grab& out) {
  using F = field::AppliedGrip;
  out = {};
  out.start = out.end = kNoPose;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kState.tag:
        return set(out.state, reader.get_uint32());
      case F::kStart.tag:
        return readPose(reader.get_view(), out.start);
      case F::kEnd.tag:
        return readPose(reader.get_view(), out.end);
      case F::kRadius.tag:
        return setFinite(out.radius, reader);
      case F::kReach.tag:
        return setFinite(out.reach, reader);
      case F::kMaxForce.tag:
        return setFinite(out.max_force, reader);
      case F::kSlipDistance.tag:
        return setFinite(out.slip_distance, reader);
      default:
        return skip(reader);
    }
  });
}

}  // namespace

std::optional<RecordedTick> readRecordedTick(Bytes message) {
  using F = field::RecordedTick;
  return readMessage<RecordedTick>(message, [](RecordedTick& tick, std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kTick.tag:
        return set(tick.tick, reader.get_uint64());
      case F::kStateHash.tag:
        return set(tick.stateHash, reader.get_fixed64());
      case F::kUnhealthy.tag:
        return set(tick.unhealthy, reader.get_bool());
      case F::kRecovery.tag:
        return set(tick.recovery, reader.get_uint32());
      case F::kKeepsState.tag:
        return set(tick.savesState, reader.get_bool());
      case F::kGravity.tag:
        return readVec3(reader.get_view(), tick.gravity);
      case F::kWind.tag:
        return readVec3(reader.get_view(), tick.wind);
      case F::kAirDensity.tag:
        return setFinite(tick.airDensity, reader);
      case F::kColliders.tag:
        return tick.colliders.size() < kMaxSceneColliders &&
               readApplied(reader.get_view(), tick.colliders.emplace_back());
      case F::kAttachments.tag:
        return tick.attachments.size() < kMaxAttachments &&
               readPose(reader.get_view(), tick.attachments.emplace_back(kNoPose));
      case F::kGrips.tag:
        return tick.grabs.size() < kMaxRecordedGrabs &&
               readApplied(reader.get_view(), tick.grabs.emplace_back());
      case F::kSubsteps.tag:
        return set(tick.substeps, reader.get_uint32());
      default:
        return skip(reader);
    }
  });
}

std::optional<Checkpoint> readCheckpoint(Bytes message) {
  using F = field::Checkpoint;
  return readMessage<Checkpoint>(message, [](Checkpoint& checkpoint, std::uint32_t tag, Reader& reader) {
    if (tag == F::kTick.tag) return set(checkpoint.tick, reader.get_uint64());
    if (tag != F::kState.tag) return skip(reader);
    const Bytes bytes = reader.get_view();
    if (bytes.size() % (6 * sizeof(float)) != 0) return false;
    checkpoint.state.resize(bytes.size() / sizeof(float));
    if (!bytes.empty()) std::memcpy(checkpoint.state.data(), bytes.data(), bytes.size());
    return true;
  });
}

std::optional<ParticipantEvent> readParticipantEvent(Bytes message) {
  using F = field::ParticipantEvent;
  return readMessage<ParticipantEvent>(
      message, [](ParticipantEvent& event, std::uint32_t tag, Reader& reader) {
        switch (tag) {
          case F::kParticipantId.tag:
            return set(event.id, reader.get_uint64());
          case F::kKind.tag:
            return set(event.kind, reader.get_uint32());
          case F::kClientName.tag:
            return setText(event.clientName, reader) && event.clientName.size() <= kMaxNameBytes;
          case F::kDisplayName.tag:
            return setText(event.name, reader) && event.name.size() <= kMaxNameBytes;
          default:
            return skip(reader);
        }
      });
}

}  // namespace clothstream::client
