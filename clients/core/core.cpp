// SPDX-License-Identifier: MIT
// The C interface over Client.
#include "clients/core/core.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <string_view>

#include "clients/core/client.h"

using namespace clothstream::client;

struct cs_client {
  Client client;
};

namespace {

std::optional<Vec3> vec3(const float* values) {
  if (!values) return std::nullopt;
  return Vec3{values[0], values[1], values[2]};
}

std::optional<Spring> spring(const float* values) {
  if (!values) return std::nullopt;
  return Spring{values[0], values[1]};
}

std::optional<float> scalar(const float* value) {
  return value ? std::optional(*value) : std::nullopt;
}

constexpr float kAsIs = std::numeric_limits<float>::quiet_NaN();

std::optional<float> given(float value) {
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

// What is not given of a spring is as it is now.
std::optional<Spring> changed(const float* values, const Spring& now) {
  if (std::isnan(values[0]) && std::isnan(values[1])) return std::nullopt;
  return Spring{given(values[0]).value_or(now[0]), given(values[1]).value_or(now[1])};
}

// What the server takes for what is not said (scene.proto).
Solver defaultSolver(std::uint32_t kind) {
  Solver solver;
  solver.kind = kind;
  if (kind == CS_SOLVER_XPBD) solver.iterations = 1;
  return solver;
}

std::optional<Solver> changed(const cs_cloth_settings& settings, const ClothParameters& now) {
  const bool any = settings.solver != CS_SOLVER_AS_IS || settings.bend_constraints >= 0 ||
                   settings.assembled >= 0 || settings.iterations != 0 || given(settings.tolerance) ||
                   given(settings.compliance) || given(settings.activation);
  if (!any) return std::nullopt;
  Solver solver = now.solver;
  if (settings.solver != CS_SOLVER_AS_IS && settings.solver != solver.kind) {
    const auto known = now.solvers.find(settings.solver);
    solver = known == now.solvers.end() ? defaultSolver(settings.solver) : known->second;
  }
  if (settings.bend_constraints >= 0) solver.bendConstraints = settings.bend_constraints != 0;
  if (settings.assembled >= 0) solver.path = settings.assembled != 0 ? kAssembled : kMatrixFree;
  if (settings.iterations != 0) solver.iterations = settings.iterations;
  solver.tolerance = given(settings.tolerance).value_or(solver.tolerance);
  if (given(settings.compliance)) solver.compliance = settings.compliance;
  solver.activation = given(settings.activation).value_or(solver.activation);
  return solver;
}

ClothChange changeOf(const Cloth& cloth, const cs_cloth_settings& settings) {
  const ClothParameters& now = cloth.parameters;
  return {.name = cloth.name,
          .structural = changed(settings.structural, now.structural),
          .shear = changed(settings.shear, now.shear),
          .bend = changed(settings.bend, now.bend),
          .damping = given(settings.damping),
          .drag = given(settings.drag),
          .lift = given(settings.lift),
          .friction = given(settings.friction),
          .thickness = given(settings.thickness),
          .solver = changed(settings, now),
          .ballRadius = given(settings.ball_radius),
          .ballFriction = given(settings.ball_friction),
          .tetherSlack = given(settings.tether_slack),
          .dihedralBending = given(settings.dihedral_bending)};
}

template <typename Values>
void copy(const Values& values, float* out) {
  std::copy(values.begin(), values.end(), out);
}

cs_participant toC(const Participant& participant) {
  return {.id = participant.id,
          .name = participant.name.c_str(),
          .client_name = participant.clientName.c_str(),
          .role = participant.role,
          .away = participant.away ? 1 : 0};
}

// The element, or nullptr where there is none.
template <typename Element>
const Element* at(const std::vector<Element>& elements, std::uint32_t index) {
  return index < elements.size() ? &elements[index] : nullptr;
}

int writeCollider(const Collider* collider, cs_collider* out) {
  if (!collider) return 0;
  *out = {};
  out->name = collider->name.c_str();
  copy(collider->position, out->position);
  copy(collider->orientation, out->orientation);
  out->shape = collider->shape;
  out->radius = collider->radius;
  out->length = collider->length;
  copy(collider->size, out->size);
  out->participant_id = collider->participantId;
  return 1;
}

}  // namespace

cs_client* cs_create(const char* scene, const char* client_name) noexcept {
  return cs_create_as(scene, client_name, "", CS_ROLE_UNSPECIFIED);
}

cs_client* cs_create_as(const char* scene, const char* client_name, const char* display_name,
                        uint32_t role) noexcept {
  assert(scene && client_name && display_name);
  // NOLINTNEXTLINE(bugprone-unhandled-exception-at-new): where memory runs out, the program ends.
  return new cs_client{Client({.scene = scene,
                               .clientName = client_name,
                               .displayName = display_name,
                               .role = role,
                               .wanted = {},
                               .token = {},
                               .contentId = 0})};
}

void cs_destroy(cs_client* client) noexcept {
  delete client;
}

void cs_want(cs_client* client, uint32_t quality, uint32_t temporal_layers) noexcept {
  client->client.want({quality, temporal_layers});
}

void cs_set_clock(cs_client* client, uint64_t (*now_us)(void)) noexcept {
  client->client.setClock(now_us);
}

uint32_t cs_receive(cs_client* client, const uint8_t* message, size_t bytes, uint64_t now_us) noexcept {
  return client->client.receive(Bytes(reinterpret_cast<const char*>(message), bytes), now_us);
}

void cs_update(cs_client* client, uint64_t now_us) noexcept {
  client->client.update(now_us);
}

const uint8_t* cs_next_outgoing(cs_client* client, size_t* bytes) noexcept {
  const std::string* message = client->client.nextOutgoing();
  *bytes = message ? message->size() : 0;
  return message ? reinterpret_cast<const uint8_t*>(message->data()) : nullptr;
}

void cs_connecting(cs_client* client, uint64_t now_us) noexcept {
  client->client.connecting(now_us);
}

void cs_disconnected(cs_client* client, uint64_t now_us) noexcept {
  client->client.disconnected(now_us);
}

uint64_t cs_connect_at(const cs_client* client) noexcept {
  return client->client.connectAtUs();
}

int cs_resumed(const cs_client* client) noexcept {
  return client->client.resumed() ? 1 : 0;
}

cs_state cs_get_state(const cs_client* client) noexcept {
  return client->client.state();
}

const char* cs_error_text(const cs_client* client) noexcept {
  return client->client.errorText().c_str();
}

uint32_t cs_error_code(const cs_client* client) noexcept {
  return client->client.errorCode();
}

const char* cs_notice_text(const cs_client* client) noexcept {
  return client->client.notice().text.c_str();
}

uint64_t cs_notice_participant(const cs_client* client) noexcept {
  return client->client.notice().participantId;
}

void cs_get_statistics(const cs_client* client, uint64_t now_us, cs_statistics* out) noexcept {
  const FrameStatistics& frames = client->client.statistics();
  *out = {};
  out->tick = frames.tick();
  out->frames = frames.frames();
  out->key_frames = frames.keyFrames();
  out->dropped = frames.dropped();
  out->decode_errors = frames.decodeErrors();
  out->bytes = frames.bytes();
  out->hash_mismatches = frames.hashMismatches();
  out->frames_per_second = frames.framesPerSecond(now_us);
  out->kbit_per_second = frames.kbitPerSecond(now_us);
  out->bits_per_vertex = frames.bitsPerVertex();
  out->round_trip_ms = client->client.clock().roundTripMs();
  out->clock_offset_us = client->client.clock().offsetUs(now_us);
  out->decode_ms = client->client.decodeMs();
}

int cs_get_operating_point(const cs_client* client, uint32_t* quality, uint32_t* temporal_layers) noexcept {
  const OperatingPoint point = client->client.operatingPoint();
  *quality = point.quality;
  *temporal_layers = point.temporalLayers;
  return client->client.described() ? 1 : 0;
}

const char* cs_server_name(const cs_client* client) noexcept {
  return client->client.welcome().serverName.c_str();
}

const char* cs_device_name(const cs_client* client) noexcept {
  return client->client.welcome().deviceName.c_str();
}

const char* cs_scene_name(const cs_client* client) noexcept {
  return client->client.welcome().scene.c_str();
}

uint32_t cs_participant_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.participants().size());
}

int cs_get_participant(const cs_client* client, uint32_t index, cs_participant* out) noexcept {
  const Participant* participant = at(client->client.participants(), index);
  if (!participant) return 0;
  *out = toC(*participant);
  return 1;
}

int cs_get_presence(const cs_client* client, cs_presence* out) noexcept {
  const Presence& presence = client->client.presence();
  if (presence.kind == 0) return 0;
  *out = {.kind = presence.kind,
          .reason = presence.reason,
          .by = presence.by,
          .participant = toC(presence.participant)};
  return 1;
}

uint32_t cs_get_role(const cs_client* client) noexcept {
  return client->client.welcome().role;
}

void cs_set_role(cs_client* client, uint64_t participant_id, uint32_t role) noexcept {
  client->client.setRole(participant_id, role);
}

void cs_remove_participant(cs_client* client, uint64_t participant_id) noexcept {
  client->client.remove(participant_id);
}

uint64_t cs_participant_id(const cs_client* client) noexcept {
  return client->client.welcome().participantId;
}

uint32_t cs_stream_rate(const cs_client* client) noexcept {
  return client->client.description().streamRate;
}

uint32_t cs_simulation_rate(const cs_client* client) noexcept {
  return client->client.description().simulationRate;
}

double cs_stream_seconds(const cs_client* client) noexcept {
  return client->client.statistics().streamSeconds();
}

uint32_t cs_vertex_count(const cs_client* client) noexcept {
  return client->client.description().layout.vertexCount();
}

const float* cs_positions(const cs_client* client) noexcept {
  return client->client.positions().data();
}

const float* cs_normals(const cs_client* client) noexcept {
  return client->client.normals().data();
}

uint64_t cs_reconstruction_hash(const cs_client* client) noexcept {
  return client->client.reconstructionHash();
}

const uint32_t* cs_triangles(const cs_client* client, uint32_t* index_count) noexcept {
  const std::vector<std::uint32_t>& triangles = client->client.description().triangles;
  *index_count = static_cast<std::uint32_t>(triangles.size());
  return triangles.data();
}

uint32_t cs_cloth_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.description().cloths.size());
}

int cs_get_cloth(const cs_client* client, uint32_t index, cs_cloth* out) noexcept {
  const Description& description = client->client.description();
  const Cloth* cloth = at(description.cloths, index);
  if (!cloth) return 0;
  const clothstream::codec::ClothLayout& layout = description.layout.cloths[index];
  *out = {.name = cloth->name.c_str(),
          .first_vertex = cloth->firstVertex,
          .vertex_count = layout.vertexCount,
          .rows = layout.rows,
          .columns = layout.columns,
          .first_index = cloth->firstIndex,
          .index_count = cloth->indexCount};
  return 1;
}

const float* cs_uvs(const cs_client* client, uint32_t cloth, uint32_t* count) noexcept {
  const Cloth* found = at(client->client.description().cloths, cloth);
  *count = found ? static_cast<std::uint32_t>(found->uvs.size() / 2) : 0;
  return *count > 0 ? found->uvs.data() : nullptr;
}

const uint32_t* cs_uv_indices(const cs_client* client, uint32_t cloth, uint32_t* count) noexcept {
  const Cloth* found = at(client->client.description().cloths, cloth);
  *count = found ? static_cast<std::uint32_t>(found->uvIndices.size()) : 0;
  return *count > 0 ? found->uvIndices.data() : nullptr;
}

uint32_t cs_submesh_count(const cs_client* client, uint32_t cloth) noexcept {
  const Cloth* found = at(client->client.description().cloths, cloth);
  return found ? static_cast<std::uint32_t>(found->submeshes.size()) : 0;
}

int cs_get_submesh(const cs_client* client, uint32_t cloth, uint32_t index, cs_submesh* out) noexcept {
  const Cloth* found = at(client->client.description().cloths, cloth);
  const Submesh* submesh = found ? at(found->submeshes, index) : nullptr;
  if (!submesh) return 0;
  *out = {
      .name = submesh->name.c_str(), .first_index = submesh->firstIndex, .index_count = submesh->indexCount};
  return 1;
}

uint32_t cs_collider_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.colliders().size());
}

int cs_get_collider(const cs_client* client, uint32_t index, cs_collider* out) noexcept {
  return writeCollider(at(client->client.colliders(), index), out);
}

const float* cs_get_hull(const cs_client* client, uint32_t index, uint32_t* vertex_count,
                         const uint32_t** triangles, uint32_t* index_count) noexcept {
  const Collider* collider = at(client->client.colliders(), index);
  const Hull* hull = collider ? hullOf(*collider, client->client.description()) : nullptr;
  *vertex_count = hull ? static_cast<std::uint32_t>(hull->vertices.size() / 3) : 0;
  *index_count = hull ? static_cast<std::uint32_t>(hull->triangles.size()) : 0;
  *triangles = hull ? hull->triangles.data() : nullptr;
  return hull ? hull->vertices.data() : nullptr;
}

int cs_get_environment(const cs_client* client, cs_environment* out) noexcept {
  if (!client->client.described()) return 0;
  const Environment& environment = client->client.description().environment;
  copy(environment.gravity, out->gravity);
  copy(environment.wind, out->wind);
  out->air_density = environment.airDensity;
  out->gust_strength = environment.gust.strength;
  out->gust_seconds = environment.gust.seconds;
  return 1;
}

int cs_get_cloth_parameters(const cs_client* client, uint32_t index, cs_cloth_parameters* out) noexcept {
  const Cloth* cloth = at(client->client.description().cloths, index);
  if (!cloth) return 0;
  copy(cloth->parameters.structural, out->structural);
  copy(cloth->parameters.shear, out->shear);
  copy(cloth->parameters.bend, out->bend);
  out->damping = cloth->parameters.damping;
  return 1;
}

int cs_get_cloth_settings(const cs_client* client, uint32_t index, cs_cloth_settings* out) noexcept {
  const Cloth* cloth = at(client->client.description().cloths, index);
  if (!cloth || out->version != CS_CLOTH_SETTINGS_VERSION) return 0;
  const ClothParameters& parameters = cloth->parameters;
  cs_keep_cloth_settings(out);
  copy(parameters.structural, out->structural);
  copy(parameters.shear, out->shear);
  copy(parameters.bend, out->bend);
  out->damping = parameters.damping;
  out->drag = parameters.drag;
  out->lift = parameters.lift;
  out->friction = parameters.friction;
  out->thickness = parameters.thickness;
  out->dihedral_bending = parameters.dihedralBending;
  out->ball_radius = parameters.ballRadius.value_or(kAsIs);
  out->ball_friction = parameters.ballFriction.value_or(kAsIs);
  out->tether_slack = parameters.tetherSlack.value_or(kAsIs);
  out->solver = parameters.solver.kind;
  const bool constrained = out->solver == CS_SOLVER_CONSTRAINT || out->solver == CS_SOLVER_ACAD;
  if (constrained || out->solver == CS_SOLVER_XPBD || out->solver == CS_SOLVER_IMPLICIT_EULER)
    out->iterations = parameters.solver.iterations;
  if (constrained || out->solver == CS_SOLVER_IMPLICIT_EULER) out->tolerance = parameters.solver.tolerance;
  if (constrained || out->solver == CS_SOLVER_XPBD)
    out->compliance = parameters.solver.compliance.value_or(kAsIs);
  if (!constrained) return 1;
  out->bend_constraints = parameters.solver.bendConstraints ? 1 : 0;
  if (out->solver == CS_SOLVER_CONSTRAINT) out->assembled = parameters.solver.path == kAssembled ? 1 : 0;
  out->activation = parameters.solver.activation;
  return 1;
}

int cs_get_cloth_report(const cs_client* client, uint32_t index, cs_cloth_report* out) noexcept {
  const SimulationReport& report = client->client.report();
  const ClothReport* cloth = at(report.cloths, index);
  if (!cloth || out->version != CS_CLOTH_REPORT_VERSION) return 0;
  *out = {.version = CS_CLOTH_REPORT_VERSION,
          .active_constraints = cloth->activeConstraints,
          .iterations = cloth->iterations,
          .residual = cloth->residual,
          .strain_max = cloth->strainMax,
          .strain_p99 = cloth->strainP99,
          .strain_mean = cloth->strainMean,
          .kinetic_energy = cloth->kineticEnergy,
          .elastic_energy = cloth->elasticEnergy,
          .gravity_energy = cloth->gravityEnergy,
          .penetration = cloth->penetration,
          .device_ms = static_cast<float>(1000 * report.deviceSeconds),
          .tick = client->client.reportTick()};
  return 1;
}

uint32_t cs_material_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.description().materials.size());
}

const char* cs_material(const cs_client* client, uint32_t index) noexcept {
  const std::string* material = at(client->client.description().materials, index);
  return material ? material->c_str() : "";
}

const char* cs_cloth_material(const cs_client* client, uint32_t cloth) noexcept {
  const Cloth* found = at(client->client.description().cloths, cloth);
  return found ? found->parameters.material.c_str() : "";
}

uint64_t cs_parameters_participant(const cs_client* client) noexcept {
  return client->client.parametersParticipant();
}

void cs_keep_cloth_settings(cs_cloth_settings* out) noexcept {
  *out = {.version = CS_CLOTH_SETTINGS_VERSION,
          .structural = {kAsIs, kAsIs},
          .shear = {kAsIs, kAsIs},
          .bend = {kAsIs, kAsIs},
          .damping = kAsIs,
          .drag = kAsIs,
          .lift = kAsIs,
          .friction = kAsIs,
          .thickness = kAsIs,
          .solver = CS_SOLVER_AS_IS,
          .bend_constraints = -1,
          .iterations = 0,
          .tolerance = kAsIs,
          .compliance = kAsIs,
          .activation = kAsIs,
          .assembled = -1,
          .dihedral_bending = kAsIs,
          .ball_radius = kAsIs,
          .ball_friction = kAsIs,
          .tether_slack = kAsIs};
}

int cs_change_cloth(cs_client* client, const char* cloth, const cs_cloth_settings* settings) noexcept {
  if (settings->version != CS_CLOTH_SETTINGS_VERSION) return 0;
  ParameterChange change;
  const std::string_view name = cloth;
  for (const Cloth& present : client->client.description().cloths)
    if (name.empty() || name == present.name) change.cloths.push_back(changeOf(present, *settings));
  if (change.cloths.empty()) return 0;
  client->client.change(change);
  return 1;
}

uint32_t cs_grab_event_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.grabEvents().size());
}

int cs_get_grab_event(const cs_client* client, uint32_t index, cs_grab_event* out) noexcept {
  const cs_grab_event* event = at(client->client.grabEvents(), index);
  if (!event) return 0;
  *out = *event;
  return 1;
}

void cs_want_contacts(cs_client* client, int wants, uint64_t now_us) noexcept {
  client->client.wantContacts(wants != 0, now_us);
}

uint32_t cs_contact_event_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.contactEvents().size());
}

int cs_get_contact_event(const cs_client* client, uint32_t index, cs_contact_event* out) noexcept {
  const ContactEvent* event = at(client->client.contactEvents(), index);
  if (!event) return 0;
  *out = {.kind = event->kind,
          .collider_id = event->colliderId,
          .participant_id = event->participantId,
          .collider = event->collider.c_str(),
          .cloth = event->cloth.c_str(),
          .impulse = event->impulse,
          .seconds = event->seconds};
  return 1;
}

void cs_set_colliders(cs_client* client, const float* spheres, uint32_t count, uint64_t now_us) noexcept {
  std::array<cs_own_collider, CS_MAX_COLLIDERS> colliders{};
  count = std::min(count, CS_MAX_COLLIDERS);
  for (std::uint32_t i = 0; i < count; ++i) {
    const float* sphere = spheres + 4 * i;
    colliders[i].shape = CS_SHAPE_SPHERE;
    std::copy(sphere, sphere + 3, colliders[i].position);
    colliders[i].radius = sphere[3];
  }
  cs_set_shapes(client, colliders.data(), count, now_us);
}

void cs_set_shapes(cs_client* client, const cs_own_collider* colliders, uint32_t count,
                   uint64_t now_us) noexcept {
  client->client.setColliders(std::span(colliders, std::min(count, CS_MAX_COLLIDERS)), now_us);
}

int cs_set_hand(cs_client* client, uint32_t side, const float* joints, uint32_t count,
                uint64_t now_us) noexcept {
  if (side != CS_HAND_LEFT && side != CS_HAND_RIGHT) return 0;
  if (count != 0 && count != CS_HAND_JOINTS && count != CS_HAND_JOINTS - 1) return 0;
  client->client.setHand(side, std::span(joints, std::size_t{4} * count), now_us);
  return 1;
}

void cs_set_grabs(cs_client* client, const cs_grab* grabs, uint32_t count, uint64_t now_us) noexcept {
  client->client.setGrabs(std::span(grabs, std::min(count, CS_MAX_GRABS)), now_us);
}

void cs_move_attachment(cs_client* client, const char* attachment, const float* position3,
                        const float* orientation4, uint64_t now_us) noexcept {
  AttachmentPose pose{.name = attachment};
  std::copy(position3, position3 + 3, pose.position.begin());
  if (orientation4 != nullptr) std::copy(orientation4, orientation4 + 4, pose.orientation.begin());
  client->client.move(std::move(pose), now_us);
}

void cs_set_environment(cs_client* client, const float* gravity3, const float* wind3,
                        const float* air_density) noexcept {
  ParameterChange change;
  change.gravity = vec3(gravity3);
  change.wind = vec3(wind3);
  change.airDensity = scalar(air_density);
  client->client.change(change);
}

void cs_set_gust(cs_client* client, float strength, float seconds) noexcept {
  ParameterChange change;
  change.gust = Gust{strength, seconds};
  client->client.change(change);
}

void cs_set_material(cs_client* client, const char* cloth, const char* material) noexcept {
  ParameterChange change;
  ClothChange& clothChange = change.cloths.emplace_back();
  clothChange.name = cloth;
  clothChange.material = material;
  client->client.change(change);
}

void cs_set_cloth(cs_client* client, const char* cloth, const float* structural2, const float* shear2,
                  const float* bend2, const float* damping) noexcept {
  ParameterChange change;
  ClothChange& clothChange = change.cloths.emplace_back();
  clothChange.name = cloth;
  clothChange.structural = spring(structural2);
  clothChange.shear = spring(shear2);
  clothChange.bend = spring(bend2);
  clothChange.damping = scalar(damping);
  client->client.change(change);
}

void cs_set_collider(cs_client* client, const char* collider, const float* position3,
                     const float* radius) noexcept {
  const std::optional<Vec3> position = vec3(position3);
  client->client.change(ColliderChange{collider, position ? &*position : nullptr, radius});
}

void cs_default_play_out(cs_play_out_options* out) noexcept {
  *out = {.version = CS_PLAY_OUT_OPTIONS_VERSION,
          .frames = 32,
          .delay_ms = std::numeric_limits<double>::quiet_NaN(),
          .least_delay_ms = 0,
          .most_delay_ms = 250,
          .lead_ms = 30};
}

int cs_set_play_out(cs_client* client, const cs_play_out_options* options) noexcept {
  return client->client.setPlayOut(options) ? 1 : 0;
}

int cs_play_out(cs_client* client, uint64_t now_us, uint64_t display_time_us, cs_played* out) noexcept {
  if (out && out->version != CS_PLAYED_VERSION) return 0;
  const std::optional<cs_played> played = client->client.play(now_us, display_time_us);
  if (!played) return 0;
  if (out) *out = *played;
  return 1;
}

const float* cs_played_positions(const cs_client* client) noexcept {
  return client->client.playedPositions().data();
}

const float* cs_played_normals(const cs_client* client) noexcept {
  return client->client.playedNormals().data();
}

uint32_t cs_played_collider_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.playedColliders().size());
}

int cs_get_played_collider(const cs_client* client, uint32_t index, cs_collider* out) noexcept {
  return writeCollider(at(client->client.playedColliders(), index), out);
}

int cs_get_stage_statistics(const cs_client* client, cs_stage_statistics* out) noexcept {
  if (out->version != CS_STAGE_STATISTICS_VERSION) return 0;
  *out = client->client.stages();
  return 1;
}

void cs_request_key_frame(cs_client* client, uint64_t now_us) noexcept {
  client->client.requestEarlyKeyFrame(now_us);
}

int cs_get_playback(const cs_client* client, uint64_t now_us, cs_playback* out) noexcept {
  const auto playback = client->client.playback(now_us);
  if (!playback) return 0;
  *out = *playback;
  return 1;
}

void cs_pause(cs_client* client, int paused) noexcept {
  client->client.control({.paused = paused != 0});
}

void cs_seek(cs_client* client, double seconds) noexcept {
  client->client.control({.seek = seconds});
}

void cs_set_speed(cs_client* client, double speed) noexcept {
  client->client.control({.speed = speed});
}

void cs_set_loop(cs_client* client, int loop) noexcept {
  client->client.control({.loop = loop != 0});
}

void cs_list_scenes(cs_client* client) noexcept {
  client->client.listScenes();
}

uint32_t cs_scene_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.scenes().size());
}

const char* cs_scene(const cs_client* client, uint32_t index) noexcept {
  const std::string* scene = at(client->client.scenes(), index);
  return scene ? scene->c_str() : "";
}
