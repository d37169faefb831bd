// SPDX-License-Identifier: MIT
#include "server/events/event.h"

#include <fmt/chrono.h>
#include <nlohmann/json.hpp>

namespace clothstream::events {
namespace {

using Json = nlohmann::ordered_json;

// RFC 3339 in UTC with milliseconds.
std::string toText(std::chrono::system_clock::time_point time) {
  const auto milliseconds = std::chrono::floor<std::chrono::milliseconds>(time);
  const auto seconds = std::chrono::floor<std::chrono::seconds>(milliseconds);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(seconds)),
                     (milliseconds - seconds).count());
}

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
  const Json body{{"type", type}, {"timestamp", toText(event.time)}, {"data", std::move(data)}};
  // Invalid UTF-8 is replaced.
  return body.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace clothstream::events
