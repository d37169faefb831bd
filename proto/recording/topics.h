// SPDX-License-Identifier: MIT
// The channels of a recording.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace clothstream::recording {

enum class Topic : std::uint8_t {
  description,   // StreamDescription
  frames,        // Frame
  reports,       // SimulationReport: those of frames once more, by themselves
  parameters,    // ParameterChanged
  events,        // TickEvents
  notices,       // Notice
  participants,  // ParticipantEvent; this and what follows only on a server
  scene,         // RecordedScene
  ticks,         // RecordedTick
  checkpoints,   // Checkpoint
};

inline constexpr std::array<std::string_view, 10> kTopicNames{
    "/description", "/frames",       "/reports", "/parameters", "/events",
    "/notices",     "/participants", "/scene",   "/ticks",      "/checkpoints"};

constexpr std::string_view nameOf(Topic topic) {
  return kTopicNames[static_cast<std::size_t>(topic)];
}

// Who writes asks for key frames, so that no frame is farther than this from one before it.
inline constexpr std::uint32_t kFramesAKeyFrame = 24;

// Of what the recording was made on and with; the names are in docs/recording.md.
inline constexpr std::string_view kFactsName = "clothstream";

}  // namespace clothstream::recording
