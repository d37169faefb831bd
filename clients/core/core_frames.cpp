// SPDX-License-Identifier: MIT
// C interface: what the scene contains, the newest frame, and play-out.
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

uint32_t cs_stream_rate(const cs_client* client) noexcept {
  return client->client.stream().description().streamRate;
}

uint32_t cs_simulation_rate(const cs_client* client) noexcept {
  return client->client.stream().description().simulationRate;
}

uint32_t cs_frame_divisor(const cs_client* client) noexcept {
  return client->client.stream().frameDivisor();
}

uint32_t cs_vertex_count(const cs_client* client) noexcept {
  return client->client.stream().description().layout.vertexCount();
}

const float* cs_positions(const cs_client* client) noexcept {
  return client->client.stream().positions().data();
}

const float* cs_normals(const cs_client* client) noexcept {
  return client->client.stream().normals().data();
}

int cs_sends_normals(const cs_client* client) noexcept {
  return client->client.stream().description().layout.normals != clothstream::codec::NormalMode::none ? 1 : 0;
}

uint64_t cs_reconstruction_hash(const cs_client* client) noexcept {
  const NewestFrame& newest = client->client.stream().newest();
  return newest.present() ? newest.hash() : 0;
}

const uint32_t* cs_triangles(const cs_client* client, uint32_t* index_count) noexcept {
  const std::vector<std::uint32_t>& triangles = client->client.stream().description().triangles;
  *index_count = static_cast<std::uint32_t>(triangles.size());
  return triangles.data();
}

uint32_t cs_cloth_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.stream().description().cloths.size());
}

int cs_get_cloth(const cs_client* client, uint32_t index, cs_cloth* out) noexcept {
  const Description& description = client->client.stream().description();
  const Cloth* cloth = at(description.cloths, index);
  if (!cloth || out->version != CS_CLOTH_VERSION) return 0;
  const clothstream::codec::ClothLayout& layout = description.layout.cloths[index];
  *out = {.version = CS_CLOTH_VERSION,
          .name = cloth->name.c_str(),
          .first_vertex = cloth->firstVertex,
          .vertex_count = layout.vertexCount,
          .rows = layout.rows,
          .columns = layout.columns,
          .first_index = cloth->firstIndex,
          .index_count = cloth->indexCount};
  return 1;
}

const float* cs_uvs(const cs_client* client, uint32_t cloth, uint32_t* count) noexcept {
  const Cloth* found = at(client->client.stream().description().cloths, cloth);
  *count = found ? static_cast<std::uint32_t>(found->uvs.size() / 2) : 0;
  return *count > 0 ? found->uvs.data() : nullptr;
}

const uint32_t* cs_uv_indices(const cs_client* client, uint32_t cloth, uint32_t* count) noexcept {
  const Cloth* found = at(client->client.stream().description().cloths, cloth);
  *count = found ? static_cast<std::uint32_t>(found->uvIndices.size()) : 0;
  return *count > 0 ? found->uvIndices.data() : nullptr;
}

uint32_t cs_submesh_count(const cs_client* client, uint32_t cloth) noexcept {
  const Cloth* found = at(client->client.stream().description().cloths, cloth);
  return found ? static_cast<std::uint32_t>(found->submeshes.size()) : 0;
}

int cs_get_submesh(const cs_client* client, uint32_t cloth, uint32_t index, cs_submesh* out) noexcept {
  const Cloth* found = at(client->client.stream().description().cloths, cloth);
  const Submesh* submesh = found ? at(found->submeshes, index) : nullptr;
  if (!submesh || out->version != CS_SUBMESH_VERSION) return 0;
  *out = {.version = CS_SUBMESH_VERSION,
          .name = submesh->name.c_str(),
          .first_index = submesh->firstIndex,
          .index_count = submesh->indexCount};
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
  const Hull* hull = collider ? hullOf(*collider, client->client.stream().description()) : nullptr;
  *vertex_count = hull ? static_cast<std::uint32_t>(hull->vertices.size() / 3) : 0;
  *index_count = hull ? static_cast<std::uint32_t>(hull->triangles.size()) : 0;
  *triangles = hull ? hull->triangles.data() : nullptr;
  if (!hull) return nullptr;
  // Colliders of the scene have the same indices in the shown state.
  const Collider* shown = at(client->client.playedColliders(), index);
  const std::vector<float>& joints =
      shown && shown->name == collider->name ? shown->joints : collider->joints;
  if (hull->skin.rest.empty() || joints.size() != hull->skin.rest.size()) return hull->vertices.data();
  pose(hull->skin, hull->vertices, joints, client->posed);
  return client->posed.data();
}

int cs_set_play_out(cs_client* client, const cs_play_out_options* options) noexcept {
  return client->client.setPlayOut(options) ? 1 : 0;
}

void cs_default_play_out(cs_play_out_options* out) noexcept {
  *out = {.version = CS_PLAY_OUT_OPTIONS_VERSION,
          .frames = 32,
          .delay_ms = std::numeric_limits<double>::quiet_NaN(),
          .least_delay_ms = 0,
          .most_delay_ms = 250,
          .lead_ms = 30};
}

int cs_play_out(cs_client* client, uint64_t now_us, uint64_t display_time_us, cs_played* out) noexcept {
  if (out && out->version != CS_PLAYED_VERSION) return 0;
  const std::optional<cs_played> played = client->client.play(now_us, display_time_us);
  if (!played) return 0;
  if (out) *out = *played;
  return 1;
}

void cs_set_local_contact(cs_client* client, int on) noexcept {
  client->client.setLocalContact(on != 0);
}

float cs_local_correction(const cs_client* client) noexcept {
  return client->client.largestCorrection();
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
