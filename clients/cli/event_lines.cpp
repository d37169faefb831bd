// SPDX-License-Identifier: MIT
#include "clients/cli/event_lines.h"

#include <cstddef>
#include <cstdlib>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/json_text.h"
#include "clients/cli/presence.h"
#include "clients/native/native_client.h"

namespace clothstream::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string lineOf(const Json& object) {
  return jsonText(object, -1) + '\n';
}

// Start of each event: its name and the time of the newest frame, in seconds since the first.
Json event(const cs_client* client, const char* name) {
  return {{"event", name}, {"seconds", cs_stream_seconds(client)}};
}

Json participantOf(const cs_participant& participant) {
  return {{"id", participant.id},
          {"name", participant.name},
          {"client", participant.client_name},
          {"role", roleName(participant.role)},
          {"away", participant.away != 0}};
}

std::string joinedLine(const cs_client* client) {
  Json object = event(client, "joined");
  object["scene"] = cs_scene_name(client);
  object["id"] = cs_participant_id(client);
  object["role"] = roleName(cs_get_role(client));
  object["participants"] = Json::array();
  cs_participant participant;
  for (std::uint32_t i = 0; cs_get_participant(client, i, &participant) != 0; ++i)
    object["participants"].push_back(participantOf(participant));
  return lineOf(object);
}

const char* nameOf(const cs_presence& presence) {
  switch (presence.kind) {
    case CS_PRESENCE_JOINED:
      return "participantJoined";
    case CS_PRESENCE_LEFT:
      return presence.reason == CS_LEAVE_REMOVED     ? "participantRemoved"
             : presence.reason == CS_LEAVE_TIMED_OUT ? "participantTimedOut"
                                                     : "participantLeft";
    case CS_PRESENCE_ROLE_CHANGED:
      return "roleChanged";
    case CS_PRESENCE_DISCONNECTED:
      return "participantDisconnected";
    case CS_PRESENCE_RETURNED:
      return "participantReturned";
    case CS_PRESENCE_BODY_CHANGED:
      return "bodyChanged";
    default:
      return "presence";
  }
}

std::string presenceLine(const cs_client* client, const cs_presence& presence,
                         const cs_participant& participant) {
  Json object = event(client, nameOf(presence));
  object["participant"] = participantOf(participant);
  if (presence.kind == CS_PRESENCE_BODY_CHANGED) object["body"] = cs_body_of(client, participant.id);
  if (presence.by != 0) object["by"] = presence.by;
  return lineOf(object);
}

std::string contactLines(const cs_client* client) {
  std::string lines;
  cs_contact_event contact;
  for (std::uint32_t i = 0; cs_get_contact_event(client, i, &contact) != 0; ++i) {
    const bool began = contact.kind == CS_CONTACT_BEGAN;
    Json object = event(client, began ? "contactBegan" : "contactEnded");
    object["cloth"] = contact.cloth;
    if (contact.participant_id == 0) {
      object["collider"] = contact.collider;
    } else {
      object["participant"] = contact.participant_id;
      object["colliderId"] = contact.collider_id;
    }
    object["impulse"] = contact.impulse;
    if (!began) object["duration"] = contact.seconds;
    lines += lineOf(object);
  }
  return lines;
}

std::string grabLines(const cs_client* client) {
  std::string lines;
  cs_grab_event grab;
  for (std::uint32_t i = 0; cs_get_grab_event(client, i, &grab) != 0; ++i) {
    Json object = event(client, grab.kind == CS_GRAB_TAKEN     ? "grabTaken"
                                : grab.kind == CS_GRAB_SLIPPED ? "grabSlipped"
                                                               : "grabReleased");
    object["participant"] = grab.participant_id;
    object["grab"] = grab.grab_id;
    object["vertices"] = grab.vertices;
    lines += lineOf(object);
  }
  return lines;
}

std::string playbackLine(const cs_client* client) {
  cs_playback playback;
  if (cs_get_playback(client, NativeClient::nowUs(), &playback) == 0) return "";
  Json object = event(client, "playback");
  object["position"] = playback.position;
  object["length"] = playback.length;
  object["speed"] = playback.speed;
  object["loop"] = playback.loop != 0;
  object["paused"] = playback.paused != 0;
  return lineOf(object);
}

// FNV-1a of the bytes of the positions, 64 bits.
std::uint64_t hashOf(std::span<const float> positions) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const std::byte byte : std::as_bytes(positions))
    hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3u;
  return hash;
}

std::string frameLine(const cs_client* client) {
  cs_statistics statistics;
  cs_get_statistics(client, NativeClient::nowUs(), &statistics);
  Json object = event(client, "frame");
  object["tick"] = statistics.tick;
  object["hash"] =
      fmt::format("{:016x}", hashOf({cs_positions(client), std::size_t{3} * cs_vertex_count(client)}));
  return lineOf(object);
}

std::string textLine(const cs_client* client, const char* name, const char* text, std::uint64_t by = 0) {
  Json object = event(client, name);
  object["text"] = text;
  if (by != 0) object["by"] = by;
  return lineOf(object);
}

}  // namespace

std::string EventLines::of(cs_client* client, std::uint32_t events) {
  std::string lines;
  const auto happened = [&](std::uint32_t bit) { return (events & bit) != 0; };
  const bool reconnecting = cs_get_state(client) == CS_STATE_RECONNECTING;
  if (reconnecting && !reconnecting_) lines += lineOf(event(client, "connectionLost"));
  reconnecting_ = reconnecting;
  if (happened(CS_EVENT_RETURNED)) {
    Json object = event(client, "reconnected");
    object["resumed"] = cs_resumed(client) != 0;
    lines += lineOf(object);
  }
  cs_presence presence;
  cs_participant participant;
  if (happened(CS_EVENT_PARTICIPANTS) && cs_participant_id(client) != joinedAs_) {
    joinedAs_ = cs_participant_id(client);
    lines += joinedLine(client);
  } else if (happened(CS_EVENT_PRESENCE) && cs_get_presence(client, &presence, &participant) != 0) {
    lines += presenceLine(client, presence, participant);
  }
  if (frames_ && happened(CS_EVENT_FRAME)) lines += frameLine(client);
  if (happened(CS_EVENT_FRAME)) lines += yieldLines(client);
  if (happened(CS_EVENT_CONTACTS)) lines += contactLines(client);
  if (happened(CS_EVENT_GRABS)) lines += grabLines(client);
  if (happened(CS_EVENT_PLAYBACK)) lines += playbackLine(client);
  if (happened(CS_EVENT_PARAMETERS)) {
    Json object = event(client, "parametersChanged");
    if (const std::uint64_t by = cs_parameters_participant(client); by != 0) object["by"] = by;
    lines += lineOf(object);
  }
  if (happened(CS_EVENT_NOTICE))
    lines += textLine(client, "notice", cs_notice_text(client), cs_notice_participant(client));
  if (happened(CS_EVENT_ERROR)) lines += textLine(client, "error", cs_error_text(client));
  return lines;
}

// Lines for the colliders that have begun to yield since the last frame, and for those that no longer do.
std::string EventLines::yieldLines(const cs_client* client) {
  std::set<std::pair<std::uint64_t, std::string>> yielding;
  cs_collider collider;
  for (std::uint32_t i = 0; cs_get_collider(client, i, &collider) != 0; ++i)
    if (collider.yields != 0) yielding.emplace(collider.participant_id, collider.name);
  std::string lines;
  const auto addMissing = [&](const char* name, const auto& from, const auto& to) {
    for (const auto& key : from) {
      if (to.contains(key)) continue;
      Json object = event(client, name);
      object["participant"] = key.first;
      object["colliderId"] = std::strtoul(key.second.c_str(), nullptr, 10);
      lines += lineOf(object);
    }
  };
  addMissing("colliderYields", yielding, yielding_);
  addMissing("colliderFollows", yielding_, yielding);
  yielding_ = std::move(yielding);
  return lines;
}

std::string summaryLine(const std::string& object) {
  Json line{{"event", "summary"}};
  line.update(Json::parse(object));
  return lineOf(line);
}

}  // namespace clothstream::cli
