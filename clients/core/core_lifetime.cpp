// SPDX-License-Identifier: MIT
// C interface: creating a client, its connection, messages and state.
#include <cstdint>
#include <optional>
#include <string>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

namespace {

const char* textOf(const char* text) {
  return text ? text : "";
}

cs_client* create(const cs_client_options& options, Client::Kind kind) {
  if (options.version != CS_CLIENT_OPTIONS_VERSION) return nullptr;
  // NOLINTNEXTLINE(bugprone-unhandled-exception-at-new): out of memory ends the program.
  return new cs_client{Client({.scene = textOf(options.scene),
                               .clientName = textOf(options.client_name),
                               .displayName = textOf(options.display_name),
                               .role = options.role,
                               .quality = 0,
                               .token = {},
                               .contentId = 0},
                              kind)};
}

Bytes bytesOf(const std::uint8_t* message, std::size_t bytes) {
  return {reinterpret_cast<const char*>(message), bytes};
}

}  // namespace

cs_client* cs_create(const cs_client_options* options) noexcept {
  return create(*options, Client::Kind::whole);
}

cs_client* cs_create_mirror(const cs_client_options* options) noexcept {
  return create(*options, Client::Kind::mirror);
}

void cs_destroy(cs_client* client) noexcept {
  delete client;
}

void cs_want(cs_client* client, uint32_t quality) noexcept {
  client->client.want(quality);
}

void cs_set_token(cs_client* client, const char* token) noexcept {
  client->client.prove({.token = token, .pairingCode = {}});
}

void cs_set_pairing_code(cs_client* client, const char* code) noexcept {
  client->client.prove({.token = {}, .pairingCode = code});
}

int cs_renew_token(cs_client* client, const char* token) noexcept {
  return client->client.renew(token) ? 1 : 0;
}

const char* cs_token(const cs_client* client) noexcept {
  return client->client.token().c_str();
}

int cs_set_resume_token(cs_client* client, const char* token) noexcept {
  return client->client.resume(token) ? 1 : 0;
}

const char* cs_resume_token(cs_client* client) noexcept {
  client->resumeToken = client->client.resumeToken();
  return client->resumeToken.c_str();
}

void cs_set_clock(cs_client* client, uint64_t (*now_us)(void)) noexcept {
  client->client.setClock(now_us);
}

void cs_default_limits(cs_limits* out) noexcept {
  *out = Limits{}.toC();
}

int cs_set_limits(cs_client* client, const cs_limits* limits) noexcept {
  const std::optional<Limits> allowed = limits == nullptr ? std::nullopt : Limits::from(*limits);
  if (!allowed) return 0;
  client->client.setLimits(*allowed);
  return 1;
}

uint32_t cs_receive(cs_client* client, const uint8_t* message, size_t bytes, uint64_t now_us) noexcept {
  return client->client.receive(bytesOf(message, bytes), now_us);
}

uint32_t cs_receive_decoded(cs_client* mirror, const uint8_t* message, size_t bytes,
                            const cs_decoded* decoded, uint64_t now_us) noexcept {
  return mirror->client.receive(bytesOf(message, bytes), now_us, decoded);
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

void cs_follow_redirects(cs_client* client, int on) noexcept {
  client->client.followRedirects(on != 0);
}

const char* cs_connect_server(const cs_client* client) noexcept {
  return client->client.connectServer().c_str();
}

const char* cs_next_server(const cs_client* client) noexcept {
  return client->client.nextServer().c_str();
}

int cs_resumed(const cs_client* client) noexcept {
  return client->client.resumed() ? 1 : 0;
}

cs_state cs_get_state(const cs_client* client) noexcept {
  return client->client.state();
}

const char* cs_error_text(const cs_client* client) noexcept {
  return client->client.error().text.c_str();
}

uint32_t cs_error_code(const cs_client* client) noexcept {
  return client->client.error().code;
}

const char* cs_error_server(const cs_client* client) noexcept {
  return client->client.error().server.c_str();
}

const char* cs_notice_text(const cs_client* client) noexcept {
  return client->client.notice().text.c_str();
}

uint64_t cs_notice_participant(const cs_client* client) noexcept {
  return client->client.notice().participantId;
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
