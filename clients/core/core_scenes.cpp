// SPDX-License-Identifier: MIT
// C interface: scenes of the server.
#include <cstdint>
#include <string>
#include <string_view>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

static_assert(CS_MAX_SCENE_BYTES == Upload::kMaxBytes);

void cs_list_scenes(cs_client* client) noexcept {
  client->client.listScenes();
}

uint32_t cs_scene_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.scenes().size());
}

int cs_get_scene(const cs_client* client, uint32_t index, cs_scene_summary* out) noexcept {
  const SceneSummary* scene = at(client->client.scenes(), index);
  if (!scene || out->version != CS_SCENE_SUMMARY_VERSION) return 0;
  *out = {.version = CS_SCENE_SUMMARY_VERSION,
          .name = scene->name.c_str(),
          .description = scene->description.c_str(),
          .vertex_count = scene->vertices,
          .cloth_count = scene->cloths,
          .participants = scene->participants,
          .max_participants = scene->maxParticipants,
          .running = scene->running ? 1 : 0,
          .paused = scene->paused ? 1 : 0,
          .created = scene->created ? 1 : 0,
          .recorded = scene->recorded ? 1 : 0,
          .is_recording = scene->isRecording ? 1 : 0};
  return 1;
}

int cs_get_answer(const cs_client* client, cs_answer* out) noexcept {
  const Answer& answer = client->client.requests().answer();
  if (out->version != CS_ANSWER_VERSION || answer.requestId == 0) return 0;
  *out = {.version = CS_ANSWER_VERSION,
          .request = answer.request,
          .request_id = answer.requestId,
          .error = answer.error,
          .error_text = answer.errorText.c_str(),
          .name = answer.name.c_str(),
          .bytes = answer.bytes,
          .repairs = answer.repairs.c_str()};
  return 1;
}

uint64_t cs_create_scene(cs_client* client, const uint8_t* scene, size_t bytes, const char* name,
                         uint32_t max_participants) noexcept {
  return client->client.createScene({reinterpret_cast<const char*>(scene), bytes}, name, max_participants);
}

uint64_t cs_copy_scene(cs_client* client, const char* source, const char* name,
                       uint32_t max_participants) noexcept {
  return client->client.copyScene(source, name, max_participants);
}

int cs_get_upload(const cs_client* client, uint64_t* sent_bytes, uint64_t* bytes) noexcept {
  const Upload& upload = client->client.requests().currentUpload();
  if (!upload.isActive()) return 0;
  *sent_bytes = upload.sent();
  *bytes = upload.bytes();
  return 1;
}

uint64_t cs_delete_scene(cs_client* client, const char* scene) noexcept {
  return client->client.deleteScene(scene);
}

uint64_t cs_reset_scene(cs_client* client, const char* scene) noexcept {
  return client->client.controlScene(scene, {.reset = true});
}

uint64_t cs_pause_scene(cs_client* client, const char* scene, int paused) noexcept {
  return client->client.controlScene(scene, {.paused = paused != 0});
}

uint64_t cs_start_recording(cs_client* client, const char* scene, const char* file) noexcept {
  return client->client.startRecording(scene, file);
}

uint64_t cs_stop_recording(cs_client* client, const char* scene) noexcept {
  return client->client.stopRecording(scene);
}

uint64_t cs_request_definition(cs_client* client, const char* scene) noexcept {
  return client->client.requestDefinition(scene);
}

const uint8_t* cs_definition(const cs_client* client, size_t* bytes) noexcept {
  const std::string& definition = client->client.requests().definition();
  *bytes = definition.size();
  return definition.empty() ? nullptr : reinterpret_cast<const uint8_t*>(definition.data());
}

uint64_t cs_list_bans(cs_client* client, const char* scene) noexcept {
  return client->client.listBans(scene);
}

uint64_t cs_lift_ban(cs_client* client, const char* scene, const char* subject) noexcept {
  return client->client.liftBan(scene, subject);
}

uint32_t cs_ban_count(const cs_client* client) noexcept {
  return static_cast<std::uint32_t>(client->client.requests().bans().size());
}

int cs_get_ban(const cs_client* client, uint32_t index, cs_ban* out) noexcept {
  const Ban* ban = at(client->client.requests().bans(), index);
  if (!ban || out->version != CS_BAN_VERSION) return 0;
  *out = {.version = CS_BAN_VERSION,
          .subject = ban->subject.c_str(),
          .display_name = ban->displayName.c_str(),
          .tenant = ban->tenant.c_str()};
  return 1;
}
