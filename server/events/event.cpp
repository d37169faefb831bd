// SPDX-License-Identifier: MIT
#include "server/events/event.h"

#include <nlohmann/json.hpp>

#include "proto/text/utc_time.h"

namespace clothstream::events {
namespace {

using Json = nlohmann::ordered_json;

// Joined or Left.
template <class Visit>
void addParticipant(Json& data, const Visit& visit) {
  data["participant"] = visit.participant;
  data["role"] = scene::nameOf(visit.role);
  data["subject"] = visit.subject.name;
}

const char* typeOf(const Joined&) {
  return "participant.joined";
}
const char* typeOf(const Left&) {
  return "participant.left";
}
const char* typeOf(const Usage&) {
  return "scene.usage";
}

void add(Json& data, const Joined& joined) {
  addParticipant(data, joined);
}
void add(Json& data, const Left& left) {
  addParticipant(data, left);
  data["connectedSeconds"] = left.connectedSeconds;
}
void add(Json& data, const Usage& usage) {
  data["deviceSeconds"] = usage.deviceSeconds;
  data["sentBytes"] = usage.sentBytes;
}

}  // namespace

std::string toJson(const Event& event, const std::string& server) {
  Json data{{"server", server}, {"scene", event.scene}, {"tenant", event.tenant}};
  std::visit([&](const auto& what) { add(data, what); }, event.what);
  const char* const type = std::visit([](const auto& what) { return typeOf(what); }, event.what);
  const Json body{{"type", type}, {"timestamp", utcTime(event.time)}, {"data", std::move(data)}};
  // Invalid UTF-8 is replaced.
  return body.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace clothstream::events
