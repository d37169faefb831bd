// SPDX-License-Identifier: MIT
// Sessions for comparing builds of the client core, and the observed state of a client after each message.
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
  // hashFloats; zero if there are no vertices.
  std::uint64_t positionsHash = 0, normalsHash = 0, playedPositionsHash = 0, playedNormalsHash = 0;
  std::uint64_t playedCollidersHash = 0;  // positions and orientations
  std::uint32_t triangleCount = 0;
  std::uint64_t outgoingHash = 0;  // FNV-1a of all outgoing messages
  std::string errorText;

  bool operator==(const Observation&) const = default;
};

// Regular streams, the golden packets of tests/golden, and hundreds of sessions with corrupted bytes. The
// working directory must be the project's root. The result is the same in every run.
std::vector<Session> recordedSessions();
// Session of one stream of tests/golden: its description, then one frame per packet, refused ones last.
Session goldenSession(const std::string& stream);

// Returns one observation per message. Message i arrives at i * kStepUs.
inline constexpr std::uint64_t kStepUs = 14'000;
inline constexpr double kPlayOutDelayMs = 45;
std::vector<Observation> replay(const Session& session);
void playOutForReplay(cs_client* client);
// State after the last message. Takes the outgoing messages.
Observation observe(cs_client* client, std::uint32_t events);

// Encodes numbers for a description.
template <typename T>
std::string littleEndian(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

}  // namespace clothstream::client
