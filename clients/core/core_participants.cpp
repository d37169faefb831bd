// SPDX-License-Identifier: MIT
// C interface: participants and their roles.
#include <cstdint>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

namespace {

cs_participant toC(const Participant& participant) {
  return {.version = CS_PARTICIPANT_VERSION,
          .id = participant.id,
          .name = participant.name.c_str(),
          .client_name = participant.clientName.c_str(),
          .role = participant.role,
          .away = participant.away ? 1 : 0};
}

}  // namespace

uint64_t cs_participant_id(const cs_client* client) noexcept {
  return client->client.welcome().participantId;
}

uint32_t cs_get_role(const cs_client* client) noexcept {
  return client->client.welcome().role;
}

uint32_t cs_participant_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.participants().all().size());
}

int cs_get_participant(const cs_client* client, uint32_t index, cs_participant* out) noexcept {
  const Participant* participant = at(client->client.participants().all(), index);
  if (!participant || out->version != CS_PARTICIPANT_VERSION) return 0;
  *out = toC(*participant);
  return 1;
}

int cs_get_presence(const cs_client* client, cs_presence* out, cs_participant* participant) noexcept {
  const Presence& presence = client->client.participants().newest();
  if (presence.kind == 0 || out->version != CS_PRESENCE_VERSION) return 0;
  if (participant && participant->version != CS_PARTICIPANT_VERSION) return 0;
  *out = {
      .version = CS_PRESENCE_VERSION, .kind = presence.kind, .reason = presence.reason, .by = presence.by};
  if (participant) *participant = toC(presence.participant);
  return 1;
}

void cs_set_role(cs_client* client, uint64_t participant_id, uint32_t role) noexcept {
  client->client.setRole(participant_id, role);
}

void cs_remove_participant(cs_client* client, uint64_t participant_id) noexcept {
  client->client.remove(participant_id, false);
}

void cs_ban_participant(cs_client* client, uint64_t participant_id) noexcept {
  client->client.remove(participant_id, true);
}

void cs_create_pairing_code(cs_client* client, uint32_t role) noexcept {
  client->client.createPairingCode(role);
}

int cs_get_pairing_code(const cs_client* client, cs_pairing_code* out) noexcept {
  const PairingCode& made = client->client.pairingCode();
  if (made.code.empty() || out->version != CS_PAIRING_CODE_VERSION) return 0;
  *out = {.version = CS_PAIRING_CODE_VERSION,
          .code = made.code.c_str(),
          .role = made.role,
          .valid_s = made.validSeconds};
  return 1;
}
