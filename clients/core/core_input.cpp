// SPDX-License-Identifier: MIT
// C interface: input of this participant, and events of grabs and contacts.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

namespace {

// Returns 0 and leaves *out unchanged without a point or for an unknown version, else 1.
int write(const std::optional<cs_cloth_point>& point, cs_cloth_point* out) {
  if (!point || out->version != CS_CLOTH_POINT_VERSION) return 0;
  *out = *point;
  return 1;
}

}  // namespace

int cs_set_colliders(cs_client* client, const cs_own_collider* colliders, uint32_t count,
                     uint64_t now_us) noexcept {
  const std::span used(colliders, std::min(count, CS_MAX_COLLIDERS));
  if (!haveVersion(used, CS_OWN_COLLIDER_VERSION)) return 0;
  client->client.setColliders(used, now_us);
  return 1;
}

int cs_set_hand(cs_client* client, uint32_t side, const float* joints, uint32_t count,
                uint64_t now_us) noexcept {
  if (side != CS_HAND_LEFT && side != CS_HAND_RIGHT) return 0;
  if (count != 0 && count != CS_HAND_JOINTS && count != CS_HAND_JOINTS - 1) return 0;
  client->client.setHand(side, std::span(joints, std::size_t{4} * count), now_us);
  return 1;
}

void cs_set_head(cs_client* client, const float* position3, const float* orientation4, float radius,
                 uint64_t now_us) noexcept {
  if (position3 == nullptr) return client->client.setHead(std::nullopt, now_us);
  cs_own_collider head{};
  head.shape = CS_SHAPE_SPHERE;
  std::copy(position3, position3 + 3, head.position);
  if (orientation4 != nullptr) std::copy(orientation4, orientation4 + 4, head.orientation);
  head.radius = radius;
  client->client.setHead(head, now_us);
}

int cs_set_grabs(cs_client* client, const cs_grab* grabs, uint32_t count, uint64_t now_us) noexcept {
  const std::span used(grabs, std::min(count, CS_MAX_GRABS));
  const bool isKnown =
      haveVersion(used, CS_GRAB_VERSION) && std::all_of(used.begin(), used.end(), [](const cs_grab& grab) {
        return !grab.place || grab.place->version == CS_CLOTH_POINT_VERSION;
      });
  if (!isKnown) return 0;
  client->client.setGrabs(used, now_us);
  return 1;
}

int cs_set_winds(cs_client* client, const cs_own_wind* winds, uint32_t count, uint64_t now_us) noexcept {
  const std::span used(winds, std::min(count, CS_MAX_WINDS));
  const bool isKnown = haveVersion(used, CS_OWN_WIND_VERSION) &&
                       std::all_of(used.begin(), used.end(), [](const cs_own_wind& wind) {
                         return wind.kind == CS_WIND_FAN || wind.kind == CS_WIND_VORTEX;
                       });
  if (!isKnown) return 0;
  client->client.setWinds(used, now_us);
  return 1;
}

int cs_nearest_point(const cs_client* client, const float* point3, float max_distance,
                     cs_cloth_point* out) noexcept {
  return write(client->client.nearestPoint({point3[0], point3[1], point3[2]}, max_distance), out);
}

int cs_cast_ray(const cs_client* client, const float* origin3, const float* direction3, float max_distance,
                cs_cloth_point* out) noexcept {
  return write(client->client.castRay({origin3[0], origin3[1], origin3[2]},
                                      {direction3[0], direction3[1], direction3[2]}, max_distance),
               out);
}

void cs_move_attachment(cs_client* client, const char* attachment, const float* position3,
                        const float* orientation4, int jumps, uint64_t now_us) noexcept {
  AttachmentPose pose{.name = attachment, .jumps = jumps != 0};
  std::copy(position3, position3 + 3, pose.position.begin());
  if (orientation4 != nullptr) std::copy(orientation4, orientation4 + 4, pose.orientation.begin());
  client->client.move(std::move(pose), now_us);
}

void cs_move_joints(cs_client* client, const char* collider, const float* poses, uint32_t count, int jumps,
                    uint64_t now_us) noexcept {
  const std::size_t numbers = kJointNumbers * std::min<std::size_t>(count, kMaxJoints);
  client->client.move({.collider = collider, .poses = {poses, poses + numbers}, .jumps = jumps != 0}, now_us);
}

cs_surface_policy cs_get_surface_policy(const cs_client* client) noexcept {
  const std::uint32_t policy = client->client.welcome().surfacePolicy;
  return policy >= CS_SURFACES_OFF && policy <= CS_SURFACES_EVERYONE ? static_cast<cs_surface_policy>(policy)
                                                                     : CS_SURFACES_UNKNOWN;
}

void cs_allow_surfaces(cs_client* client, uint32_t policy) noexcept {
  client->client.allowSurfaces(policy);
}

int cs_set_surface(cs_client* client, const cs_surface* surface) noexcept {
  if (surface->version != CS_SURFACE_VERSION || surface->vertex_count > CS_MAX_SURFACE_VERTICES ||
      surface->triangle_count == 0 || surface->triangle_count > CS_MAX_SURFACE_TRIANGLES)
    return 0;
  const std::size_t positions = std::size_t{3} * surface->vertex_count,
                    triangles = std::size_t{3} * surface->triangle_count;
  OwnSurface own{.id = surface->id,
                 .positions = {surface->positions, surface->positions + positions},
                 .triangles = {surface->triangles, surface->triangles + triangles},
                 .twoSided = surface->two_sided != 0,
                 .friction = surface->friction};
  std::copy(std::begin(surface->position), std::end(surface->position), own.position.begin());
  std::copy(std::begin(surface->orientation), std::end(surface->orientation), own.orientation.begin());
  return client->client.setSurface(std::move(own)) ? 1 : 0;
}

int cs_move_surface(cs_client* client, uint32_t id, const float* position3,
                    const float* orientation4) noexcept {
  std::array<float, 3> position{};
  std::array<float, 4> orientation{};
  std::copy(position3, position3 + 3, position.begin());
  if (orientation4 != nullptr) std::copy(orientation4, orientation4 + 4, orientation.begin());
  return client->client.surfaces().move(id, position, orientation) ? 1 : 0;
}

int cs_remove_surface(cs_client* client, uint32_t id) noexcept {
  return client->client.surfaces().remove(id) ? 1 : 0;
}

void cs_follow_surfaces(cs_client* client, int on) noexcept {
  client->client.followSurfaces(on != 0);
}

uint32_t cs_room_surface_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.roomSurfaces().complete().size());
}

int cs_get_room_surface(const cs_client* client, uint32_t index, cs_room_surface* out) noexcept {
  const auto& all = client->client.roomSurfaces().complete();
  if (index >= all.size() || out->version != CS_ROOM_SURFACE_VERSION) return 0;
  const auto& [entry, mesh, nextPart, isBroken] = *all[index];
  out->id = entry.id;
  out->participant_id = entry.participant;
  out->revision = entry.revision;
  std::copy(entry.position.begin(), entry.position.end(), std::begin(out->position));
  std::copy(entry.orientation.begin(), entry.orientation.end(), std::begin(out->orientation));
  out->positions = mesh.positions.data();
  out->vertex_count = entry.vertices;
  out->triangles = mesh.triangles.data();
  out->triangle_count = entry.triangles;
  out->two_sided = entry.twoSided ? 1 : 0;
  return 1;
}

uint32_t cs_grab_event_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.grabEvents().size());
}

int cs_get_grab_event(const cs_client* client, uint32_t index, cs_grab_event* out) noexcept {
  const cs_grab_event* event = at(client->client.grabEvents(), index);
  if (!event || out->version != CS_GRAB_EVENT_VERSION) return 0;
  *out = *event;
  return 1;
}

void cs_want_contacts(cs_client* client, int wants, uint64_t now_us) noexcept {
  client->client.wantContacts(wants != 0, now_us);
}

void cs_want_constraints(cs_client* client, int wants, uint64_t now_us) noexcept {
  client->client.wantConstraints(wants != 0, now_us);
}

uint32_t cs_contact_event_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.contactEvents().size());
}

int cs_get_contact_event(const cs_client* client, uint32_t index, cs_contact_event* out) noexcept {
  const ContactEvent* event = at(client->client.contactEvents(), index);
  if (!event || out->version != CS_CONTACT_EVENT_VERSION) return 0;
  *out = {.version = CS_CONTACT_EVENT_VERSION,
          .kind = event->kind,
          .collider_id = event->colliderId,
          .participant_id = event->participantId,
          .collider = event->collider.c_str(),
          .cloth = event->cloth.c_str(),
          .impulse = event->impulse,
          .seconds = event->seconds};
  return 1;
}
