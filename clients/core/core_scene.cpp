// SPDX-License-Identifier: MIT
// The C interface over Client: what the scene is, and its clock.
#include <cstdint>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

const char* cs_scene_name(const cs_client* client) noexcept {
  return client->client.welcome().scene.c_str();
}

uint32_t cs_stream_rate(const cs_client* client) noexcept {
  return client->client.description().streamRate;
}

uint32_t cs_simulation_rate(const cs_client* client) noexcept {
  return client->client.description().simulationRate;
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
