// SPDX-License-Identifier: MIT
#include "server/saved_state/contents.h"

#include <utility>

#include "server/messages/scene_message.h"
#include "server/telemetry/log.h"

namespace clothstream::saved_state {
namespace {

Read<scene::Checkpoint> readCheckpoint(const v1::SavedCheckpoint& message, bool isParsed,
                                       const model::Scene& start) {
  if (!isParsed) return tl::unexpected(std::string("it is damaged"));
  return toCheckpoint(message, start);
}

SceneContents toContents(v1::SavedParts parts) {
  SceneContents contents{.session = std::move(*parts.mutable_session()), .created = true};
  if (!parts.scene().empty()) contents.scene = std::move(*parts.mutable_scene());
  if (!parts.checkpoint().empty()) contents.checkpoint = std::move(*parts.mutable_checkpoint());
  return contents;
}

}  // namespace

v1::SavedSession parseSession(const std::string& name, const SceneContents& contents) {
  v1::SavedSession session;
  if (contents.session && !session.ParseFromString(*contents.session)) {
    telemetry::log({name}, spdlog::level::err,
                   "its participants and bans are not restored: their row is damaged");
    session.Clear();
  }
  return session;
}

void addSessionAndCheckpoint(const SceneContents& contents, scene::SavedScene& saved) {
  const std::string& name = saved.start.name;
  const v1::SavedSession session = parseSession(name, contents);
  saved.roster = toRoster(session);
  saved.paused = session.paused();
  saved.resetRequested = session.reset_requested();
  v1::Scene then = messages::toMessageWithoutMeshes(saved.start);
  if (contents.checkpoint) {
    v1::SavedCheckpoint message;
    const bool isParsed = message.ParseFromString(*contents.checkpoint);
    if (auto checkpoint = readCheckpoint(message, isParsed, saved.start)) {
      saved.checkpoint = std::move(*checkpoint);
      then = message.parameters();
    } else {
      telemetry::log({name}, spdlog::level::err,
                     "its state is not restored: {}; it starts from the beginning, with its participants "
                     "and bans",
                     checkpoint.error());
    }
  }
  if (!session.has_parameters() || session.parameters().SerializeAsString() == then.SerializeAsString())
    return;
  if (auto accepted = withParameters(session.parameters(), saved.start))
    saved.accepted = std::move(*accepted);
  else
    telemetry::log({name}, spdlog::level::err, "changes of its parameters are not restored: {}",
                   accepted.error());
}

Read<scene::SavedScene> toCreated(const SceneContents& contents) {
  v1::SavedScene message;
  if (!contents.scene || !message.ParseFromString(*contents.scene))
    return tl::unexpected(std::string("its definition is damaged"));
  Read<model::Scene> start = toScene(message.definition());
  if (!start) return tl::unexpected(std::move(start).error());
  scene::SavedScene saved{
      .start = std::move(*start), .maxParticipants = message.max_participants(), .tenant = message.tenant()};
  addSessionAndCheckpoint(contents, saved);
  return saved;
}

v1::SavedSession sessionOf(const scene::LiveScene& live, const scene::SavedRoster& roster,
                           const v1::Scene& parameters) {
  v1::SavedSession message = toMessage(roster, parameters);
  message.set_paused(live.paused);
  message.set_reset_requested(live.resetRequested);
  return message;
}

v1::SavedParts definitionOf(const scene::LiveScene& live) {
  v1::SavedParts parts;
  parts.set_scene(toMessage(live.start(), live.terms).SerializeAsString());
  return parts;
}

v1::SavedParts stateOf(const scene::LiveScene& live, const std::optional<scene::Checkpoint>& checkpoint) {
  v1::SavedParts parts;
  parts.set_session(sessionOf(live, live.roster.saved(), messages::toMessageWithoutMeshes(live.definition()))
                        .SerializeAsString());
  if (checkpoint) parts.set_checkpoint(toMessage(*checkpoint).SerializeAsString());
  return parts;
}

Read<scene::SavedScene> toSaved(v1::SavedParts parts) {
  return toCreated(toContents(std::move(parts)));
}

Read<scene::SavedScene> toSaved(v1::SavedParts parts, const model::Scene& start) {
  const SceneContents contents = toContents(std::move(parts));
  scene::SavedScene saved{.start = start};
  addSessionAndCheckpoint(contents, saved);
  if (contents.checkpoint && !saved.checkpoint) return tl::unexpected(std::string("its state is damaged"));
  return saved;
}

}  // namespace clothstream::saved_state
