// SPDX-License-Identifier: MIT
// C interface: the clock of the scene, recordings, and key-frame requests.

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

void cs_request_key_frame(cs_client* client, uint64_t now_us) noexcept {
  client->client.requestEarlyKeyFrame(now_us);
}

int cs_get_playback(const cs_client* client, uint64_t now_us, cs_playback* out) noexcept {
  const auto playback = client->client.playback(now_us);
  if (!playback || out->version != CS_PLAYBACK_VERSION) return 0;
  *out = *playback;
  return 1;
}

int cs_in_lockstep(const cs_client* client) noexcept {
  return client->client.inLockstep() ? 1 : 0;
}

void cs_hold_acknowledgements(cs_client* client, int on) noexcept {
  client->client.holdAcknowledgements(on != 0);
}

void cs_acknowledge_seen(cs_client* client) noexcept {
  client->client.acknowledgeSeen();
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
