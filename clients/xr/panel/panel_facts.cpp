// SPDX-License-Identifier: MIT
#include "clients/xr/panel/panel_facts.h"

namespace clothstream::xr {
namespace {

const char* nameOf(std::uint32_t role) {
  switch (role) {
    case CS_ROLE_VIEWER:
      return "viewer";
    case CS_ROLE_PARTICIPANT:
      return "participant";
    case CS_ROLE_OWNER:
      return "owner";
    default:
      return "";
  }
}

void readScenes(const cs_client* client, PanelFacts& facts) {
  facts.scene = cs_scene_name(client);
  facts.scenes.clear();
  facts.isPaused = false;
  for (std::uint32_t i = 0; i < cs_scene_count(client); ++i) {
    cs_scene_summary scene;
    if (cs_get_scene(client, i, &scene) == 0) continue;
    facts.scenes.push_back({scene.name, scene.participants});
    if (facts.scene == scene.name) facts.isPaused = scene.paused != 0;
  }
}

void readPeople(const cs_client* client, PanelFacts& facts) {
  facts.people.clear();
  const std::uint64_t self = cs_participant_id(client);
  for (std::uint32_t i = 0; i < cs_participant_count(client); ++i) {
    cs_participant person;
    if (cs_get_participant(client, i, &person) == 0) continue;
    const bool hasName = *person.name != '\0';
    facts.people.push_back(
        {.name = hasName ? FixedText(person.name) : FixedText::format("participant {}", person.id),
         .detail = person.away != 0 ? "away" : nameOf(person.role),
         .isSelf = person.id == self});
  }
}

}  // namespace

void readPanelFacts(cs_client* client, std::uint64_t nowUs, PanelFacts& facts) {
  readScenes(client, facts);
  readPeople(client, facts);
  const bool isLive = cs_get_state(client) == CS_STATE_JOINED;
  facts.mayAct = isLive && cs_get_role(client) != CS_ROLE_VIEWER;
  facts.figures.clear();
  cs_statistics statistics;
  cs_stage_statistics stages;
  if (cs_get_statistics(client, nowUs, &statistics) == 0 || cs_get_stage_statistics(client, &stages) == 0)
    return;
  const double up = statistics.round_trip_ms / 2;
  facts.figures = {
      {"stream", FixedText::format("{:.0f} frames/s", statistics.frames_per_second)},
      {"vertices", FixedText::format("{}", cs_vertex_count(client))},
      {"network", FixedText::format("{:.0f} kbit/s", statistics.kbit_per_second)},
      {"precision", FixedText::format("{:.1f} bits/vertex", statistics.bits_per_vertex)},
      {"round trip", FixedText::format("{:.1f} ms", statistics.round_trip_ms)},
      {"pose to picture", FixedText::format("{:.0f} ms", up + stages.delay_ms)},
      {"play-out", FixedText::format("{:.0f} ms", stages.delay_ms)},
      {"decode", FixedText::format("{:.2f} ms", statistics.decode_ms)},
      {"dropped", FixedText::format("{}", statistics.dropped)},
  };
  facts.status = isLive ? FixedText::format("{:.0f} frames/s, round trip {:.0f} ms",
                                            statistics.frames_per_second, statistics.round_trip_ms)
                              .view()
                        : "The connection is lost";
}

}  // namespace clothstream::xr
