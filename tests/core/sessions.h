// SPDX-License-Identifier: MIT
// Sessions that every build of the client core must take alike, and what is seen of a client after each
// message.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/core/scripted_server.h"

namespace clothstream::client {

struct Session {
  std::string name;
  std::vector<std::string> messages;  // serialised ServerMessages
};

struct Observation {
  std::uint32_t events = 0;
  cs_state state = CS_STATE_JOINING;
  std::uint64_t tick = 0, decodeErrors = 0, hashMismatches = 0;
  std::uint64_t reconstructionHash = 0;
  // hashFloats, zero where there are no vertices.
  std::uint64_t positionsHash = 0, normalsHash = 0, playedPositionsHash = 0, playedNormalsHash = 0;
  std::uint64_t playedCollidersHash = 0;  // of position and orientation
  std::uint32_t triangleCount = 0;
  std::uint64_t outgoingHash = 0;  // FNV-1a of all that the client wants to send
  std::string errorText;

  bool operator==(const Observation&) const = default;
};

// Regular streams, the golden packets of tests/golden, and some hundred sessions with spoilt bytes; the
// working directory is the project's root. The same in every run.
std::vector<Session> recordedSessions();
// Of one stream of tests/golden: its description, then a frame a packet.
Session goldenSession(const std::string& stream);

// One after each message, message i arriving at i * kStepUs.
inline constexpr std::uint64_t kStepUs = 14'000;
inline constexpr double kPlayOutDelayMs = 45;
std::vector<Observation> replay(const Session& session);

// Numbers as a description has them.
template <typename T>
std::string littleEndian(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

}  // namespace clothstream::client
