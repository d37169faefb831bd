// SPDX-License-Identifier: MIT
// Channels of a recording.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace clothstream::recording {

enum class Topic : std::uint8_t {
  description,   // StreamDescription
  frames,        // Frame
  reports,       // SimulationReport; a copy of the reports in frames
  parameters,    // ParameterChanged
  events,        // TickEvents
  notices,       // Notice
  participants,  // ParticipantEvent; this and the following ones only in recordings of a server
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

// Maximum distance in frames between key frames. The writer of a recording requests key frames at this
// interval.
inline constexpr std::uint32_t kMaxKeyFrameDistance = 24;

// Name of the metadata record: machine and program that made the recording. docs/recording.md lists its
// entries.
inline constexpr std::string_view kMetadataName = "clothstream";
// Entry of a finished recording of a client: number of frames of quality 0, 1, 2 and 3.
inline constexpr const char* kQualitiesEntry = "frames_of_quality";

}  // namespace clothstream::recording
