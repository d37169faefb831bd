// SPDX-License-Identifier: MIT
#include "server/saved_state/state_message.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "server/messages/cloth_skin_message.h"
#include "server/messages/grab_place.h"
#include "server/messages/local_wind.h"
#include "server/messages/scene_message.h"
#include "server/messages/shapes.h"
#include "server/messages/solid_message.h"
#include "server/messages/vectors.h"
#include "server/saved_state/crc.h"
#include "server/scene/resume_token.h"
#include "server/scene/snapshot_message.h"

namespace clothstream::saved_state {
namespace {

using Slot = scene::GrabsAndAttachments::Slot;

// Reads numbers unchanged: quaternions are not normalised again.
model::Vec3 toVec3(const v1::Vec3& message) {
  return {message.x(), message.y(), message.z()};
}

model::Quaternion toQuaternion(const v1::Quaternion& message) {
  return {message.w(), message.x(), message.y(), message.z()};
}

model::Pose toPose(const v1::Pose& message) {
  return {toVec3(message.position()), toQuaternion(message.orientation())};
}

bool isFinite(const model::Pose& pose) {
  return pose.position.allFinite() && pose.orientation.coeffs().allFinite() && pose.orientation.norm() > 0.5f;
}

void restoreMotion(const v1::Motion& message, model::Motion& motion) {
  for (std::size_t i = 0; i < motion.keys.size(); ++i)
    motion.keys[i].orientation = toQuaternion(message.keys(static_cast<int>(i)).orientation());
}

// Sets the quaternions of the scene to those of its message, which messages::toScene() has normalised again.
void restoreQuaternions(const v1::Scene& message, model::Scene& scene) {
  for (std::size_t i = 0; i < scene.cloths.size(); ++i) {
    const v1::Cloth& from = message.cloths(static_cast<int>(i));
    model::Cloth& cloth = scene.cloths[i];
    if (!cloth.mesh) cloth.grid.pose.orientation = toQuaternion(from.grid().pose().orientation());
    for (std::size_t j = 0; j < cloth.attachments.size(); ++j) {
      const v1::Attachment& attachment = from.attachments(static_cast<int>(j));
      if (!attachment.has_pose()) continue;
      cloth.attachments[j].pose.orientation = toQuaternion(attachment.pose().orientation());
      restoreMotion(attachment.motion(), cloth.attachments[j].motion);
    }
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const v1::Collider& from = message.colliders(static_cast<int>(i));
    scene.colliders[i].pose.orientation = toQuaternion(from.pose().orientation());
    restoreMotion(from.motion(), scene.colliders[i].motion);
  }
}

void write(const Slot& slot, v1::SavedGrab& message) {
  if (slot.phase != Slot::Phase::holds) return;
  message.set_number(slot.number);
  message.set_participant_id(slot.participant);
  message.set_id(slot.now.id);
  messages::write(slot.now.pose, *message.mutable_pose());
  messages::write(slot.before, *message.mutable_before());
  message.set_radius(slot.now.radius);
  message.set_reach(slot.now.reach);
  message.set_max_force(slot.now.maxForce);
  message.set_slip_distance(slot.now.slipDistance);
  if (slot.vertices) message.set_vertices(*slot.vertices);
  if (slot.now.place) messages::write(*slot.now.place, *message.mutable_place());
  message.set_age(slot.age);
}

Slot toSlot(const v1::SavedGrab& message) {
  if (message.number() == 0) return {};
  Slot slot{.participant = message.participant_id(),
            .now = {.id = message.id(),
                    .pose = toPose(message.pose()),
                    .radius = message.radius(),
                    .reach = message.reach(),
                    .maxForce = message.max_force(),
                    .slipDistance = message.slip_distance()},
            .before = toPose(message.has_before() ? message.before() : message.pose()),
            .phase = Slot::Phase::holds,
            .number = message.number(),
            .age = message.age()};
  if (message.has_vertices()) slot.vertices = message.vertices();
  return slot;
}

// Joints of every collider that has them.
bool readJoints(const v1::SavedCheckpoint& message, const model::Scene& scene,
                scene::ColliderSet::State& state) {
  state.joints.resize(scene.colliders.size());
  for (const v1::SavedJoints& saved : message.joints()) {
    if (saved.collider() >= scene.colliders.size()) return false;
    scene::ColliderSet::Joints& joints = state.joints[saved.collider()];
    for (const v1::Pose& pose : saved.joints()) joints.now.push_back(toPose(pose));
    if (saved.moved()) joints.target = joints.now;
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const auto* solid = std::get_if<model::Solid>(&scene.colliders[i].shape);
    const bool hasJoints = solid != nullptr && (*solid)->skin;
    if (state.joints[i].now.size() != (hasJoints ? (*solid)->skin->joints.size() : 0) ||
        !std::ranges::all_of(state.joints[i].now, isFinite))
      return false;
  }
  return true;
}

bool isUsable(const scene::ColliderSet::Yield& yield) {
  return isFinite(yield.accepted) && std::isfinite(yield.depth) && std::isfinite(yield.step) &&
         yield.step >= scene::kLeastStep;
}

scene::ColliderSet::Yield toYield(const v1::SavedYield& message) {
  return {.accepted = toPose(message.accepted()),
          .depth = message.depth(),
          .step = message.step(),
          .refused = message.refused(),
          .stands = message.stands()};
}

void write(const scene::ColliderSet::Yield& yield, v1::SavedYield& message) {
  messages::write(yield.accepted, *message.mutable_accepted());
  message.set_depth(yield.depth);
  message.set_step(yield.step);
  message.set_refused(yield.refused);
  message.set_stands(yield.stands);
}

bool readColliders(const v1::SavedCheckpoint& message, const model::Scene& scene,
                   scene::ColliderSet::State& state) {
  if (static_cast<std::size_t>(message.scene_colliders_size()) != scene.colliders.size() ||
      static_cast<std::size_t>(message.colliders_size()) + scene.colliders.size() > simulation::kMaxColliders)
    return false;
  for (const v1::Pose& pose : message.scene_colliders()) state.scenePoses.push_back(toPose(pose));
  if (!readJoints(message, scene, state)) return false;
  for (const v1::SavedCollider& from : message.colliders()) {
    messages::Checks checks;
    const model::Shape shape = messages::toShape(checks, messages::Path("shape"), from.shape());
    if (!std::move(checks).result(true)) return false;
    state.colliders.push_back({from.participant_id(),
                               {.id = from.id(), .pose = toPose(from.pose()), .shape = shape},
                               toPose(from.before()),
                               toPose(from.before()),
                               {},
                               from.depth()});
    if (from.has_yield()) state.colliders.back().yield = toYield(from.yield());
  }
  return std::ranges::all_of(state.scenePoses, isFinite) &&
         std::ranges::all_of(state.colliders, [](const scene::ColliderSet::Placed& placed) {
           return isFinite(placed.before) && isFinite(placed.now.pose) && placed.depth >= 0 &&
                  (!placed.yield || isUsable(*placed.yield));
         });
}

bool readWinds(const v1::SavedCheckpoint& message, std::vector<scene::HeldWinds::Placed>& winds) {
  for (const v1::SavedWind& from : message.winds()) {
    messages::Checks checks;
    model::LocalWind wind = messages::toLocalWind(checks, messages::Path("wind"), from.wind());
    if (checks.failed()) return false;
    wind.pose = toPose(from.wind().pose());
    winds.push_back({from.participant_id(), wind});
  }
  return std::ranges::is_sorted(winds, {}, &scene::HeldWinds::Placed::participant);
}

bool readGrabs(const v1::SavedCheckpoint& message, const model::Scene& scene,
               const simulation::HeldNodes& held, scene::GrabsAndAttachments::State& state) {
  std::size_t attachments = 0;
  for (const model::Cloth& cloth : scene.cloths) attachments += cloth.attachments.size();
  state.moved.resize(attachments);
  for (const v1::SavedAttachment& moved : message.attachments()) {
    if (moved.attachment() >= attachments) return false;
    state.moved[moved.attachment()] = toPose(moved.pose());
    if (!isFinite(*state.moved[moved.attachment()])) return false;
  }
  for (const v1::Pose& frame : message.frames()) state.frames.push_back(toPose(frame));
  if (!state.frames.empty() && state.frames.size() != attachments) return false;
  if (!std::ranges::all_of(state.frames, isFinite)) return false;
  if (static_cast<std::size_t>(message.grabs_size()) > simulation::kMaxGrabs) return false;
  for (const v1::SavedGrab& grab : message.grabs()) {
    state.slots.push_back(toSlot(grab));
    Slot& slot = state.slots.back();
    if (grab.has_place()) {
      messages::Checks checks;
      slot.now.place = messages::toGrabPlace(checks, messages::Path("place"), grab.place(), scene);
      if (checks.failed()) return false;
    }
    const bool holds = slot.phase == Slot::Phase::holds;
    // The device must know what the grab holds.
    if (holds &&
        (!isFinite(slot.now.pose) || !isFinite(slot.before) || state.slots.size() > held.grabs.size()))
      return false;
  }
  return std::ranges::all_of(held.nodes, [&](const simulation::HeldNode& node) {
    return node.grab < state.slots.size() && state.slots[node.grab].phase == Slot::Phase::holds;
  });
}

}  // namespace

v1::SavedScene toMessage(const model::Scene& start, const scene::SceneTerms& terms) {
  v1::SavedScene message;
  message.set_max_participants(terms.maxParticipants);
  message.set_tenant(terms.tenant);
  v1::Scene definition = messages::toMessage(start);
  if (terms.created) {
    *message.mutable_definition() = std::move(definition);
    return message;
  }
  const std::string bytes = definition.SerializeAsString();
  message.set_definition_bytes(bytes.size());
  message.set_definition_crc(crcOf(bytes));
  return message;
}

bool isOf(const v1::SavedScene& message, const model::Scene& start) {
  const v1::SavedScene now = toMessage(start, scene::SceneTerms{});
  return message.definition_bytes() == now.definition_bytes() &&
         message.definition_crc() == now.definition_crc();
}

Read<model::Scene> toScene(const v1::Scene& message) {
  messages::Result<model::Scene> scene = messages::toScene(message);
  if (!scene) return tl::unexpected(scene.error().text);
  restoreQuaternions(message, *scene);
  return std::move(*scene);
}

v1::SavedSession toMessage(const scene::SavedRoster& roster, const v1::Scene& parameters) {
  v1::SavedSession message;
  *message.mutable_parameters() = parameters;
  for (const scene::SavedParticipant& saved : roster.participants) {
    v1::SavedParticipant& to = *message.add_participants();
    to.set_id(saved.participant.id);
    to.set_display_name(saved.participant.displayName);
    to.set_client_name(saved.participant.clientName);
    to.set_role(scene::toMessage(saved.participant.role));
    to.set_token_hash(saved.tokenHash);
    to.set_attempt(saved.attempt);
    to.set_subject(saved.subject.name);
    to.set_tenant(saved.subject.tenant);
    to.set_granted_role(saved.grantedRole);
    to.set_owns_by_token(saved.ownsByToken);
    to.set_body(saved.participant.body);
  }
  for (const scene::Ban& ban : roster.bans) {
    v1::SavedBan& to = *message.add_bans();
    to.set_subject(ban.subject.name);
    to.set_tenant(ban.subject.tenant);
    to.set_display_name(ban.displayName);
  }
  for (const std::string& hash : roster.refusedTokenHashes) message.add_refused_token_hashes(hash);
  return message;
}

scene::SavedRoster toRoster(const v1::SavedSession& message) {
  scene::SavedRoster roster;
  for (const v1::SavedParticipant& from : message.participants())
    if (from.id() != 0 && from.token_hash().size() == scene::kTokenHashBytes)
      roster.participants.push_back({.participant = {.id = from.id(),
                                                     .displayName = from.display_name(),
                                                     .clientName = from.client_name(),
                                                     .role = scene::fromMessage(from.role()),
                                                     .away = true,
                                                     .body = from.body()},
                                     .tokenHash = from.token_hash(),
                                     .subject = {.tenant = from.tenant(), .name = from.subject()},
                                     .attempt = from.attempt(),
                                     .grantedRole = from.granted_role(),
                                     .ownsByToken = from.owns_by_token()});
  for (const v1::SavedBan& ban : message.bans())
    if (!ban.subject().empty())
      roster.bans.push_back({{.tenant = ban.tenant(), .name = ban.subject()}, ban.display_name()});
  for (const std::string& hash : message.refused_token_hashes())
    if (hash.size() == scene::kTokenHashBytes) roster.refusedTokenHashes.push_back(hash);
  return roster;
}

v1::SavedCheckpoint toMessage(const scene::Checkpoint& checkpoint) {
  v1::SavedCheckpoint message;
  scene::write(checkpoint.state, *message.mutable_state());
  *message.mutable_parameters() = messages::toMessageWithoutMeshes(checkpoint.scene);
  for (std::size_t i = 0; i < checkpoint.scene.cloths.size(); ++i) {
    v1::SavedCloth& cloth = *message.add_cloths();
    if (const auto& fraction = checkpoint.scene.cloths[i].solver.correctionFraction)
      cloth.set_correction_fraction(*fraction);
    cloth.set_ease_until(checkpoint.easeUntil[i]);
  }
  for (const model::Pose& pose : checkpoint.colliders.scenePoses)
    messages::write(pose, *message.add_scene_colliders());
  for (std::size_t i = 0; i < checkpoint.colliders.joints.size(); ++i) {
    const scene::ColliderSet::Joints& joints = checkpoint.colliders.joints[i];
    if (joints.now.empty()) continue;
    v1::SavedJoints& to = *message.add_joints();
    to.set_collider(static_cast<std::uint32_t>(i));
    for (const model::Pose& pose : joints.now) messages::write(pose, *to.add_joints());
    to.set_moved(!joints.target.empty());
  }
  for (const scene::ColliderSet::Placed& placed : checkpoint.colliders.colliders) {
    v1::SavedCollider& to = *message.add_colliders();
    to.set_participant_id(placed.participant);
    to.set_id(placed.now.id);
    messages::write(placed.before, *to.mutable_before());
    messages::write(placed.now.pose, *to.mutable_pose());
    messages::write(placed.now.shape, *to.mutable_shape());
    to.set_depth(placed.depth);
    if (placed.yield) write(*placed.yield, *to.mutable_yield());
  }
  for (std::size_t i = 0; i < checkpoint.grabs.moved.size(); ++i) {
    if (!checkpoint.grabs.moved[i]) continue;
    v1::SavedAttachment& to = *message.add_attachments();
    to.set_attachment(static_cast<std::uint32_t>(i));
    messages::write(*checkpoint.grabs.moved[i], *to.mutable_pose());
  }
  for (const Slot& slot : checkpoint.grabs.slots) write(slot, *message.add_grabs());
  for (const model::Pose& pose : checkpoint.grabs.frames) messages::write(pose, *message.add_frames());
  for (const scene::HeldWinds::Placed& placed : checkpoint.winds) {
    v1::SavedWind& to = *message.add_winds();
    to.set_participant_id(placed.participant);
    messages::write(placed.wind, *to.mutable_wind());
  }
  if (checkpoint.lastRecovery) message.set_last_recovery(*checkpoint.lastRecovery);
  message.set_frame_divisor(checkpoint.work.frameDivisor);
  message.set_substeps(checkpoint.work.substeps);
  return message;
}

Read<model::Scene> withParameters(const v1::Scene& parameters, const model::Scene& start) {
  if (static_cast<std::size_t>(parameters.cloths_size()) != start.cloths.size() ||
      static_cast<std::size_t>(parameters.colliders_size()) != start.colliders.size())
    return tl::unexpected(std::string("its parameters are of another scene"));
  v1::Scene whole = parameters;
  for (std::size_t i = 0; i < start.colliders.size(); ++i)
    if (const auto* solid = std::get_if<model::Solid>(&start.colliders[i].shape))
      messages::write(**solid, *whole.mutable_colliders(static_cast<int>(i))->mutable_mesh());
  for (std::size_t i = 0; i < start.cloths.size(); ++i) {
    const model::Cloth& from = start.cloths[i];
    v1::Cloth& cloth = *whole.mutable_cloths(static_cast<int>(i));
    if (from.mesh) messages::write(*from.mesh, *cloth.mutable_mesh());
    cloth.clear_skin();
    if (from.skin) messages::write(*from.skin, *cloth.mutable_skin());
  }
  Read<model::Scene> scene = toScene(whole);
  const bool same =
      scene && scene->name == start.name && scene->colliders.size() == start.colliders.size() &&
      scene->simulationRate == start.simulationRate && scene->substeps == start.substeps &&
      std::ranges::equal(scene->cloths, start.cloths, {}, &model::Cloth::nodeCount, &model::Cloth::nodeCount);
  if (scene && !same) return tl::unexpected(std::string("its parameters are of another scene"));
  // A simulation knows a mesh by its address.
  for (std::size_t i = 0; scene && i < start.colliders.size(); ++i)
    if (std::holds_alternative<model::Solid>(start.colliders[i].shape))
      scene->colliders[i].shape = start.colliders[i].shape;
  for (std::size_t i = 0; scene && i < start.cloths.size(); ++i) scene->cloths[i].skin = start.cloths[i].skin;
  return scene;
}

Read<scene::Checkpoint> toCheckpoint(const v1::SavedCheckpoint& message, const model::Scene& start) {
  const auto wrong = [](const char* what) { return tl::unexpected(std::string("its ") + what); };
  scene::Checkpoint checkpoint;
  auto state = scene::toSnapshot(message.state(), start.nodeCount());
  if (!state) return wrong(("state " + state.error()).c_str());
  checkpoint.state = std::move(*state);
  if (!simulation::statusOf(checkpoint.state, model::reachOf(start.stream)).healthy)
    return wrong("state is invalid");
  Read<model::Scene> parameters = withParameters(message.parameters(), start);
  if (!parameters) return tl::unexpected(std::move(parameters).error());
  checkpoint.scene = std::move(*parameters);
  if (static_cast<std::size_t>(message.cloths_size()) != start.cloths.size())
    return wrong("cloths are of another scene");
  for (std::size_t i = 0; i < start.cloths.size(); ++i) {
    const v1::SavedCloth& cloth = message.cloths(static_cast<int>(i));
    checkpoint.easeUntil.push_back(cloth.ease_until());
    if (!cloth.has_correction_fraction()) continue;
    if (!(cloth.correction_fraction() >= 0 && cloth.correction_fraction() <= 1))
      return wrong("correction fraction is out of range");
    checkpoint.scene.cloths[i].solver.correctionFraction = cloth.correction_fraction();
  }
  if (!readColliders(message, checkpoint.scene, checkpoint.colliders))
    return wrong("colliders do not fit the scene");
  if (!readGrabs(message, checkpoint.scene, checkpoint.state.held, checkpoint.grabs))
    return wrong("grabs do not fit the scene");
  if (!readWinds(message, checkpoint.winds)) return wrong("winds are invalid");
  if (message.has_last_recovery()) checkpoint.lastRecovery = message.last_recovery();
  // Without the work, the scene has all of it.
  checkpoint.work = {std::max(1u, message.frame_divisor()),
                     message.substeps() > 0 ? message.substeps() : start.substeps};
  if (checkpoint.work.frameDivisor > start.streamRate || checkpoint.work.substeps > start.substeps)
    return wrong("work is more than that of the scene");
  return checkpoint;
}

}  // namespace clothstream::saved_state
