// SPDX-License-Identifier: MIT
// Converts envelopes, join requests and poses of clients.
#include "server/messages/client_message.h"

#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "proto/text/visible.h"
#include "server/messages/followed_place.h"
#include "server/messages/grab_place.h"
#include "server/messages/hands.h"
#include "server/messages/limits.h"
#include "server/messages/local_wind.h"
#include "server/messages/shapes.h"
#include "server/messages/skin_message.h"
#include "server/messages/validation.h"
#include "server/messages/vectors.h"
#include "server/model/cloth_skin.h"
#include "server/model/origin.h"

namespace clothstream::messages {
namespace {

tl::unexpected<FieldError> refuse(v1::ErrorCode code, std::string text) {
  return tl::unexpected(FieldError{code, std::move(text)});
}

void checkNew(Checks& checks, const Path& path, std::uint32_t id, std::unordered_set<std::uint32_t>& ids) {
  if (!ids.insert(id).second)
    checks.fail(path / "id", fmt::format("{}", id), "is used twice; ids must be unique");
}

void readColliders(Checks& checks, const Path& poses, const v1::ColliderPoses& message,
                   model::ParticipantPoses& to) {
  checks.count(poses / "hands", static_cast<std::size_t>(message.hands_size()), 0, 2);
  if (checks.failed()) return;
  const std::size_t ofHands = kHandBones * static_cast<std::size_t>(message.hands_size());
  checks.count(poses / "colliders", static_cast<std::size_t>(message.colliders_size()), 0,
               limits::kMaxParticipantColliders - ofHands);
  std::unordered_set<std::uint32_t> ids;
  for (int i = 0; i < message.colliders_size() && !checks.failed(); ++i) {
    const v1::ParticipantCollider& from = message.colliders(i);
    const Path path = poses.at("colliders", i);
    checkNew(checks, path, from.id(), ids);
    to.colliders.push_back(
        {from.id(), toPose(checks, path / "pose", from.pose()), toShape(checks, path, from)});
  }
  for (int i = 0; i < message.hands_size() && !checks.failed(); ++i)
    for (model::ParticipantCollider& bone : toBones(checks, poses.at("hands", i), message.hands(i))) {
      checkNew(checks, poses.at("hands", i), bone.id, ids);
      to.colliders.push_back(std::move(bone));
    }
}

void readGrabs(Checks& checks, const Path& poses, const v1::ColliderPoses& message, const model::Scene& scene,
               model::ParticipantPoses& to) {
  checks.count(poses / "grabs", static_cast<std::size_t>(message.grabs_size()), 0,
               limits::kMaxParticipantGrabs);
  std::unordered_set<std::uint32_t> ids;
  for (int i = 0; i < message.grabs_size() && !checks.failed(); ++i) {
    const v1::Grab& from = message.grabs(i);
    const Path path = poses.at("grabs", i);
    checkNew(checks, path, from.id(), ids);
    model::Grab grab{.id = from.id(), .pose = toPose(checks, path / "pose", from.pose())};
    if (from.has_radius()) grab.radius = checks.number(path / "radius", from.radius(), limits::kGrabRadius);
    if (from.has_reach()) grab.reach = checks.number(path / "reach", from.reach(), limits::kGrabReach);
    if (from.has_max_force())
      grab.maxForce = checks.number(path / "maxForce", from.max_force(), limits::kGrabForce);
    if (from.has_slip_distance())
      grab.slipDistance = checks.number(path / "slipDistance", from.slip_distance(), limits::kSlipDistance);
    if (from.has_place()) grab.place = toGrabPlace(checks, path / "place", from.place(), scene);
    to.grabs.push_back(grab);
  }
}

void readWinds(Checks& checks, const Path& poses, const v1::ColliderPoses& message,
               model::ParticipantPoses& to) {
  checks.count(poses / "winds", static_cast<std::size_t>(message.winds_size()), 0,
               limits::kMaxParticipantWinds);
  std::unordered_set<std::uint32_t> ids;
  for (int i = 0; i < message.winds_size() && !checks.failed(); ++i) {
    const v1::HeldWind& from = message.winds(i);
    const Path path = poses.at("winds", i);
    checkNew(checks, path, from.id(), ids);
    to.winds.push_back({toLocalWind(checks, path / "wind", from.wind()), from.id()});
  }
}

void readAttachments(Checks& checks, const Path& poses, const v1::ColliderPoses& message,
                     const model::Scene& scene, model::ParticipantPoses& to) {
  checks.count(poses / "attachments", static_cast<std::size_t>(message.attachments_size()), 0,
               limits::kMaxAttachments);
  if (message.attachments_size() == 0 || checks.failed()) return;
  std::vector<const model::Attachment*> known;
  for (const model::Cloth& cloth : scene.cloths)
    for (const model::Attachment& attachment : cloth.attachments) known.push_back(&attachment);
  const auto nameOf = [](const model::Attachment* attachment) -> const std::string& {
    return attachment->name;
  };
  for (int i = 0; i < message.attachments_size() && !checks.failed(); ++i) {
    const v1::AttachmentPose& from = message.attachments(i);
    const Path path = poses.at("attachments", i);
    checkKnown(checks, path / "name", from.name(), known, v1::ERROR_CODE_NOT_FOUND, nameOf);
    const auto found = std::ranges::find(known, from.name(), nameOf);
    const model::Pose pose = toPose(checks, path / "pose", from.pose());
    if (checks.failed()) return;
    checkFollowedPlace(checks, path / "pose", pose.position, (*found)->pose.position, scene);
    to.attachments.push_back({static_cast<std::size_t>(found - known.begin()), pose, from.jumps()});
  }
}

// Returns nullptr after a failed check if the scene has no such collider, or it has no joints.
const model::Collider* findWithJoints(Checks& checks, const Path& path, const std::string& name,
                                      const model::Scene& scene) {
  checkKnown(checks, path, name, scene.colliders);
  if (checks.failed()) return nullptr;
  const auto found = std::ranges::find(scene.colliders, name, &model::Collider::name);
  const auto* solid = std::get_if<model::Solid>(&found->shape);
  if (solid != nullptr && (*solid)->skin) return &*found;
  checks.fail(path, '"' + name + '"', "has no joints");
  return nullptr;
}

// Cloth that follows joints out of the stream's range would roll the scene back for everyone. The bound is
// that of a sphere around the collider, which may be anywhere on its way, or where a participant has put it
// (checkFollowedPlace).
void checkJointReach(Checks& checks, const Path& path, const model::Collider& collider,
                     const model::ColliderJoints& moved, const model::Scene& scene) {
  const auto follows = [&](const model::Cloth& cloth) {
    return cloth.skin && cloth.skin->collider == collider.name;
  };
  if (checks.failed() || std::ranges::none_of(scene.cloths, follows)) return;
  const model::Skin& skin = *std::get<model::Solid>(collider.shape)->skin;
  std::vector<model::Pose> poses;
  model::compose(skin, moved.joints, poses);
  const std::vector<model::Transform> transforms = model::jointTransforms(skin, poses);
  const model::Vec3 origin = model::originOf(scene);
  float away = (collider.pose.position - origin).cwiseAbs().maxCoeff();
  if (!collider.motion.keys.empty()) away = 0;
  for (const model::MotionKey& key : collider.motion.keys)
    away = std::max(away, (key.position - origin).cwiseAbs().maxCoeff());
  const float left = model::reachOf(scene.stream) - std::max(away, mostFollowedDistance(scene));
  for (const model::Cloth& cloth : scene.cloths) {
    if (!follows(cloth)) continue;
    // Free cloth swings around its place.
    const float most = left - (cloth.skin->high - cloth.skin->low).norm();
    const float reach = model::motionBetween(cloth.skin->bounds, transforms, transforms).reach;
    if (reach > most)
      checks.fail(path / "joints", "",
                  fmt::format("take the cloth \"{}\" up to {:.4g} m away from its collider; must stay within "
                              "{:.4g} m, so that the stream holds it wherever the collider is",
                              cloth.name, reach, most));
  }
}

void readJoints(Checks& checks, const Path& poses, const v1::ColliderPoses& message,
                const model::Scene& scene, model::ParticipantPoses& to) {
  checks.count(poses / "joints", static_cast<std::size_t>(message.joints_size()), 0, limits::kMaxSolids);
  for (int i = 0; i < message.joints_size() && !checks.failed(); ++i) {
    const v1::ColliderJoints& from = message.joints(i);
    const Path path = poses.at("joints", i);
    const model::Collider* const found = findWithJoints(checks, path / "collider", from.collider(), scene);
    if (found == nullptr) return;
    const model::Skin& skin = *std::get<model::Solid>(found->shape)->skin;
    to.joints.push_back({static_cast<std::size_t>(found - scene.colliders.data()),
                         toJoints(checks, path / "joints", from.joints(), skin.joints.size()), from.jumps()});
    checkJointReach(checks, path, *found, to.joints.back(), scene);
  }
}

}  // namespace

Result<v1::ClientMessage> parseClientMessage(std::span<const std::byte> bytes) {
  if (bytes.size() > limits::kMaxClientMessageBytes)
    return tl::unexpected(FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                                     fmt::format("a message of {} bytes is too large: must have at most {}",
                                                 bytes.size(), limits::kMaxClientMessageBytes),
                                     telemetry::Refusal::messageSize});
  v1::ClientMessage message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return refuse(v1::ERROR_CODE_MALFORMED_MESSAGE,
                  fmt::format("{} bytes are not a clothstream.v1.ClientMessage", bytes.size()));
  if (message.body_case() == v1::ClientMessage::BODY_NOT_SET)
    return refuse(v1::ERROR_CODE_MALFORMED_MESSAGE,
                  "a clothstream.v1.ClientMessage has no body that this server knows");
  return message;
}

Result<Joining> toJoining(const v1::Hello& message, std::span<const std::uint32_t> codecs) {
  Checks checks;
  const Path hello("hello");
  if (message.protocol_version() == 0)
    checks.fail(hello / "protocolVersion", "0",
                fmt::format("must be 1 or more; this server speaks {}", kProtocolVersion),
                v1::ERROR_CODE_UNSUPPORTED_VERSION);
  const auto codec = std::ranges::find_first_of(message.codecs(), codecs);
  if (codec == message.codecs().end())
    checks.fail(
        hello / "codecs", "",
        fmt::format("must contain a codec of this server: {}; update the client", fmt::join(codecs, ", ")),
        v1::ERROR_CODE_UNSUPPORTED_CODEC);
  if (!message.scene().empty()) checks.name(hello / "scene", message.scene());
  checks.label(hello / "clientName", message.client_name());
  checks.label(hello / "displayName", message.display_name());
  if (message.role() < v1::ROLE_UNSPECIFIED || message.role() > v1::ROLE_OWNER)
    checks.fail(hello / "role", fmt::format("{}", static_cast<int>(message.role())),
                "must be ROLE_VIEWER, ROLE_PARTICIPANT, ROLE_OWNER or left out");
  checks.integer(hello / "quality", message.quality(), 0, limits::kMaxQualities - 1);
  if (checks.failed()) return std::move(checks).result(Joining{});
  return Joining{std::min(message.protocol_version(), kProtocolVersion),
                 *codec,
                 message.scene(),
                 visible(message.client_name()),
                 visible(message.display_name()),
                 message.role(),
                 static_cast<std::uint8_t>(message.quality())};
}

Result<v1::ParameterChange> toWornBody(const v1::WearBody& message, const model::Scene& scene) {
  v1::ParameterChange change;
  if (message.collider().empty()) return change;
  Checks checks;
  const Path path("wearBody");
  const model::Collider* const found = findWithJoints(checks, path / "collider", message.collider(), scene);
  if (message.has_stands()) {
    const model::Pose stands = toPose(checks, path / "stands", message.stands());
    if (const model::Collider* body = checks.failed() ? nullptr : found)
      checkFollowedPlace(checks, path / "stands", stands.position, body->pose.position, scene);
    v1::ColliderChange& collider = *change.add_colliders();
    collider.set_name(message.collider());
    write(stands.position, *collider.mutable_position());
    write(stands.orientation, *collider.mutable_orientation());
  }
  return std::move(checks).result(std::move(change));
}

Result<model::ParticipantPoses> toPoses(const v1::ColliderPoses& message, const model::Scene& scene) {
  Checks checks;
  const Path path("colliderPoses");
  model::ParticipantPoses poses;
  readColliders(checks, path, message, poses);
  readGrabs(checks, path, message, scene, poses);
  readWinds(checks, path, message, poses);
  readAttachments(checks, path, message, scene, poses);
  readJoints(checks, path, message, scene, poses);
  poses.wantsContacts = message.contact_events();
  poses.wantsConstraints = message.active_constraints();
  return std::move(checks).result(std::move(poses));
}

}  // namespace clothstream::messages
