// SPDX-License-Identifier: MIT
// Defaults of a scene that options of the server can change.
#pragma once

#include <cstdint>

namespace clothstream::scene {

// Participants of a scene, disconnected ones included.
inline constexpr std::uint32_t kDefaultMaxParticipants = 64;

// Frames per second that carry a simulation report.
inline constexpr double kDefaultReportRate = 4;

}  // namespace clothstream::scene
