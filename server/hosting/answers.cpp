// SPDX-License-Identifier: MIT
#include "server/hosting/answers.h"

#include <cstdint>
#include <optional>
#include <utility>

#include "server/messages/description.h"

namespace clothstream::hosting {

v1::Error toMessage(const messages::FieldError& error) {
  v1::Error message;
  message.set_code(error.code);
  message.set_text(error.text);
  return message;
}

tl::unexpected<v1::Error> refusal(v1::ErrorCode code, std::string text) {
  return tl::unexpected(toMessage({code, std::move(text)}));
}

v1::SceneSummary summaryOf(const scene::LiveScene& scene) {
  v1::SceneSummary summary = messages::toSummary(scene.start());
  if (scene.source) {
    const v1::StreamDescription& played = scene.source->description();
    std::uint32_t vertices = 0;
    for (const v1::ClothDescription& cloth : played.cloths()) vertices += cloth.vertex_count();
    summary.set_vertex_count(vertices);
    summary.set_cloth_count(static_cast<std::uint32_t>(played.cloths_size()));
    summary.set_description(played.definition().description());
    if (std::optional<v1::Playback> playback = scene.source->playback())
      *summary.mutable_playback() = std::move(*playback);
  }
  summary.set_participants(static_cast<std::uint32_t>(scene.subscribers.size()));
  summary.set_max_participants(scene.terms.maxParticipants);
  summary.set_running(scene.running);
  summary.set_paused(scene.paused);
  summary.set_created(scene.terms.created);
  summary.set_recorded(scene.journal && scene.journal->active());
  return summary;
}

}  // namespace clothstream::hosting
