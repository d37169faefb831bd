// SPDX-License-Identifier: MIT
// The C interface over Client: what play-out shows.
#include <cstdint>
#include <limits>
#include <optional>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

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
